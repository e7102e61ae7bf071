#include "closure/cavities.h"

#include <algorithm>
#include <cmath>
#include <map>
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
  std::map<int32_t, std::vector<int32_t>> next;
  const std::vector<EdgeUse> uses = CollectEdgeUses(faces);
  for (size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
    // What runs either way does not cancel where it is boundary.
    int balance = 0;
    for (; end < uses.size() && uses[end].edge == uses[begin].edge; ++end) {
      balance += uses[end].forward ? 1 : -1;
    }
    for (int k = 0; k < balance; ++k) next[uses[begin].high()].push_back(uses[begin].low());
    for (int k = 0; k < -balance; ++k) next[uses[begin].low()].push_back(uses[begin].high());
  }
  std::vector<std::vector<int32_t>> loops;
  while (!next.empty()) {
    std::vector<int32_t> path;
    std::map<int32_t, size_t> position;
    int32_t v = next.begin()->first;
    while (true) {
      if (const auto seen = position.find(v); seen != position.end()) {
        std::vector<int32_t> loop(path.begin() + static_cast<std::ptrdiff_t>(seen->second),
                                  path.end());
        for (size_t k = 0; k < loop.size(); ++k) {
          const int32_t to = k + 1 < loop.size() ? loop[k + 1] : v;
          auto& targets = next[loop[k]];
          targets.erase(std::find(targets.begin(), targets.end(), to));
          if (targets.empty()) next.erase(loop[k]);
        }
        loops.push_back(std::move(loop));
        break;
      }
      position[v] = path.size();
      path.push_back(v);
      const auto it = next.find(v);
      if (it == next.end()) {
        loops.emplace_back();
        return loops;
      }
      v = it->second.front();
    }
  }
  return loops;
}

}  // namespace amhex
