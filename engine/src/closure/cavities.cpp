#include "closure/cavities.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

namespace amhex {
namespace {

// Faces of an inverted slit may interpenetrate by this angle, in radians.
constexpr double kInvertedSlitAngle = 0.7;

class Groups {
 public:
  explicit Groups(int count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  int Find(int a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void Unite(int a, int b) {
    a = Find(a), b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

// One open face at one undirected edge.
struct EdgeUse {
  uint64_t edge;  // the lower vertex, then the higher: sorts in one comparison
  int face;
  bool forward;  // the face runs low -> high

  int32_t low() const { return static_cast<int32_t>(edge >> 32); }
  int32_t high() const { return static_cast<int32_t>(edge); }
};

std::vector<EdgeUse> CollectEdgeUses(const std::vector<CellFace>& faces) {
  std::vector<EdgeUse> uses;
  uses.reserve(4 * faces.size());
  for (size_t f = 0; f < faces.size(); ++f) {
    for (int j = 0; j < faces[f].count; ++j) {
      const int32_t a = faces[f].v[j];
      const int32_t b = faces[f].v[(j + 1) % faces[f].count];
      const auto edge =
          static_cast<uint64_t>(std::min(a, b)) << 32 | static_cast<uint32_t>(std::max(a, b));
      uses.push_back({edge, static_cast<int>(f), a < b});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.face < b.face;
  });
  return uses;
}

// Pairs the faces around an edge of many: each face that opens a wedge of void (turning
// counter-clockwise about low -> high) with the nearest that ends it.
void PairAroundEdge(const WorkingMesh& mesh, const std::vector<CellFace>& faces,
                    const EdgeUse* begin, const EdgeUse* end, Groups* groups) {
  const auto& x = mesh.vertices();
  const Vec3d axis = Normalized(x[begin->high()] - x[begin->low()]);
  const Vec3d helper = std::abs(axis.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d u = Normalized(Cross(axis, helper));
  const Vec3d w = Cross(axis, u);
  const int count = static_cast<int>(end - begin);
  std::vector<double> angle(count);
  for (int i = 0; i < count; ++i) {
    const Vec3d d = FaceCentroid(faces[begin[i].face], x) - x[begin->low()];
    angle[i] = std::atan2(Dot(d, w), Dot(d, u));
  }
  struct Wedge {
    double width;
    int opens, ends;
  };
  std::vector<Wedge> wedges;
  for (int i = 0; i < count; ++i) {
    if (!begin[i].forward) continue;
    for (int j = 0; j < count; ++j) {
      if (begin[j].forward) continue;
      double width = angle[j] - angle[i];
      while (width < -kInvertedSlitAngle) width += 2 * std::numbers::pi;
      while (width >= 2 * std::numbers::pi - kInvertedSlitAngle) width -= 2 * std::numbers::pi;
      wedges.push_back({std::abs(width), i, j});
    }
  }
  std::stable_sort(wedges.begin(), wedges.end(),
                   [](const Wedge& a, const Wedge& b) { return a.width < b.width; });
  std::vector<uint8_t> used(count, 0);
  for (const Wedge& wedge : wedges) {
    if (used[wedge.opens] || used[wedge.ends]) continue;
    used[wedge.opens] = used[wedge.ends] = 1;
    groups->Unite(begin[wedge.opens].face, begin[wedge.ends].face);
  }
}

struct Step {
  int32_t from, to;
};

// Edges of faces as numbers: the lower vertex, then the higher, then whether the face runs from the
// one to the other.
std::vector<uint64_t> SortedEdges(const std::vector<CellFace>& faces) {
  std::vector<uint64_t> edges;
  edges.reserve(4 * faces.size());
  for (const CellFace& face : faces) {
    for (int j = 0; j < face.count; ++j) {
      const int32_t a = face.v[j], b = face.v[(j + 1) % face.count];
      const auto low = static_cast<uint64_t>(std::min(a, b));
      const auto high = static_cast<uint64_t>(std::max(a, b));
      edges.push_back(low << 32 | high << 1 | (a < b ? 1 : 0));
    }
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

// What no other face takes back, reversed, by where it starts.
std::vector<Step> BoundarySteps(const std::vector<CellFace>& faces) {
  const std::vector<uint64_t> edges = SortedEdges(faces);
  std::vector<Step> steps;
  for (size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    // What runs either way does not cancel where it is boundary.
    int balance = 0;
    for (; end < edges.size() && edges[end] >> 1 == edges[begin] >> 1; ++end) {
      balance += (edges[end] & 1) != 0 ? 1 : -1;
    }
    const auto low = static_cast<int32_t>(edges[begin] >> 32);
    const auto high = static_cast<int32_t>(static_cast<uint32_t>(edges[begin]) >> 1);
    for (int k = 0; k < balance; ++k) steps.push_back({high, low});
    for (int k = 0; k < -balance; ++k) steps.push_back({low, high});
  }
  std::stable_sort(steps.begin(), steps.end(),
                   [](const Step& a, const Step& b) { return a.from < b.from; });
  return steps;
}

}  // namespace

Cavities CollectCavities(const WorkingMesh& mesh) {
  const std::vector<CellFace> open = mesh.OpenFaces();
  const std::vector<EdgeUse> uses = CollectEdgeUses(open);
  Groups groups(static_cast<int>(open.size()));
  for (size_t begin = 0; begin < uses.size();) {
    size_t end = begin + 1;
    while (end < uses.size() && uses[end].edge == uses[begin].edge) ++end;
    if (end - begin == 2) {
      groups.Unite(uses[begin].face, uses[begin + 1].face);
    } else if (end - begin > 2) {
      PairAroundEdge(mesh, open, &uses[begin], uses.data() + end, &groups);
    }
    begin = end;
  }
  Cavities cavities;
  cavities.of_half_face.assign(mesh.half_face_count(), -1);
  std::vector<int> cavity_of_group(open.size(), -1);
  for (size_t f = 0; f < open.size(); ++f) {
    const int group = groups.Find(static_cast<int>(f));
    if (cavity_of_group[group] < 0) {
      cavity_of_group[group] = cavities.count();
      cavities.faces.emplace_back();
    }
    cavities.faces[cavity_of_group[group]].push_back(open[f]);
    cavities.of_half_face[mesh.FindHalfFace(open[f])] = cavity_of_group[group];
  }
  return cavities;
}

std::vector<std::vector<int32_t>> BoundaryLoops(const std::vector<CellFace>& faces) {
  const std::vector<Step> steps = BoundarySteps(faces);
  // Vertices with steps away from them, ascending, and those that are in no loop yet.
  struct Start {
    int32_t vertex;
    size_t next, end;
    size_t place;  // in the path under way
  };
  constexpr size_t kNowhere = SIZE_MAX;
  std::vector<Start> starts;
  for (size_t i = 0; i < steps.size(); ++i) {
    if (i == 0 || steps[i].from != steps[i - 1].from) {
      starts.push_back({steps[i].from, i, i, kNowhere});
    }
    ++starts.back().end;
  }
  const auto start_at = [&](int32_t vertex) {
    const auto found =
        std::lower_bound(starts.begin(), starts.end(), vertex,
                         [](const Start& start, int32_t v) { return start.vertex < v; });
    const bool is_one =
        found != starts.end() && found->vertex == vertex && found->next < found->end;
    return is_one ? &*found : nullptr;
  };
  std::vector<std::vector<int32_t>> loops;
  std::vector<Start*> path;
  for (Start& first : starts) {
    while (first.next < first.end) {
      Start* at = &first;
      path.clear();
      while (at != nullptr && at->place == kNowhere) {
        at->place = path.size();
        path.push_back(at);
        at = start_at(steps[at->next].to);
      }
      std::vector<int32_t>& loop = loops.emplace_back();
      if (at == nullptr) return loops;
      for (size_t k = at->place; k < path.size(); ++k) {
        loop.push_back(path[k]->vertex);
        ++path[k]->next;
      }
      for (Start* passed : path) passed->place = kNowhere;
    }
  }
  return loops;
}

}  // namespace amhex
