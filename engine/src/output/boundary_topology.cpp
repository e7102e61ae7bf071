#include "output/boundary_topology.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace amhex {
namespace {

// A void is a slit if its mean thickness is below this fraction of its faces' mean edge: no solid
// that cells of that size resolve has such a cavity.
constexpr double kFlatPocketThickness = 0.05;

// Two boundary faces on three common vertices leave a slit between them if they enclose less than
// some 37 degrees (cosine of their outward normals) and, if both are quads, a void whose mean
// thickness is less than this fraction of their mean edge; more is a notch that the solid may have.
constexpr double kSlitCosine = -0.8;
constexpr double kLeastNotchThickness = 0.02;

// One corner of a boundary face: the face's two edges at a vertex.
struct FaceCorner {
  int32_t face = 0;
  int32_t next = 0;
  int32_t previous = 0;
};

// Corners of boundary faces grouped by vertex.
struct CornerTable {
  std::vector<int64_t> begin;  // [vertex_count + 1]
  std::vector<FaceCorner> corners;
};

CornerTable GroupCorners(const std::vector<BoundaryFace>& boundary, size_t vertex_count) {
  CornerTable table;
  table.begin.assign(vertex_count + 1, 0);
  for (const BoundaryFace& b : boundary) {
    for (int j = 0; j < b.face.count; ++j) ++table.begin[b.face.v[j] + 1];
  }
  std::partial_sum(table.begin.begin(), table.begin.end(), table.begin.begin());
  table.corners.resize(table.begin.back());
  std::vector<int64_t> cursor(table.begin.begin(), table.begin.end() - 1);
  for (size_t f = 0; f < boundary.size(); ++f) {
    const OutwardFace& face = boundary[f].face;
    for (int j = 0; j < face.count; ++j) {
      table.corners[cursor[face.v[j]]++] = {static_cast<int32_t>(f), face.v[(j + 1) % face.count],
                                            face.v[(j + face.count - 1) % face.count]};
    }
  }
  return table;
}

// Disjoint sets over boundary faces with path halving; roots are the smallest members.
class FaceSets {
 public:
  explicit FaceSets(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  int32_t Find(int32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(int32_t a, int32_t b) {
    a = Find(a), b = Find(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int32_t> parent_;
};

// Number of separate fans that the corners around one vertex form; 1 on a manifold.
int CountFans(const FaceCorner* corners, int count) {
  std::vector<uint8_t> seen(count, 0);
  int fans = 0;
  for (int start = 0; start < count; ++start) {
    if (seen[start]) continue;
    ++fans;
    for (int at = start; at >= 0 && !seen[at];) {
      seen[at] = 1;
      int following = -1;
      for (int k = 0; k < count; ++k) {
        if (!seen[k] && corners[k].next == corners[at].previous) following = k;
      }
      at = following;
    }
  }
  return fans;
}

// Edges from `v` to vertices of larger id, each with its uses in both directions.
void ExamineEdgesAt(int32_t v, const FaceCorner* corners, int count, FaceSets& sets,
                    BoundaryTopology& topology) {
  struct Use {
    int32_t other, face;
    int direction;
  };
  std::vector<Use> uses;
  for (int k = 0; k < count; ++k) {
    if (corners[k].next > v) uses.push_back({corners[k].next, corners[k].face, 1});
    if (corners[k].previous > v) uses.push_back({corners[k].previous, corners[k].face, -1});
  }
  std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) {
    return a.other != b.other ? a.other < b.other : a.face < b.face;
  });
  for (size_t first = 0; first < uses.size();) {
    size_t last = first;
    int balance = 0;
    for (; last < uses.size() && uses[last].other == uses[first].other; ++last) {
      balance += uses[last].direction;
      sets.Join(uses[first].face, uses[last].face);
    }
    ++topology.edge_count;
    if (last - first == 1) {
      ++topology.open_edge_count;
    } else if (last - first > 2 || balance != 0) {
      ++topology.non_manifold_edge_count;
    }
    first = last;
  }
}

int SharedVertices(const OutwardFace& a, const OutwardFace& b) {
  int shared = 0;
  for (int i = 0; i < a.count; ++i) {
    for (int j = 0; j < b.count; ++j) shared += a.v[i] == b.v[j];
  }
  return shared;
}

bool FaceEachOther(const OutwardFace& a, const OutwardFace& b, const std::vector<Vec3d>& vertices) {
  const Vec3d across = FaceCentre(b, vertices) - FaceCentre(a, vertices);
  const Vec3d normal_a = Normalized(AreaVector(a, vertices));
  const Vec3d normal_b = Normalized(AreaVector(b, vertices));
  return Dot(normal_a, normal_b) < kSlitCosine && Dot(across, normal_a) >= 0 &&
         Dot(across, normal_b) <= 0;
}

// Whether the faces, three of whose vertices are the same, are quads on both sides of a notch.
bool AreSidesOfNotch(const OutwardFace& a, const OutwardFace& b,
                     const std::vector<Vec3d>& vertices) {
  if (a.count != 4 || b.count != 4) return false;
  // Mean thickness: as bilinear patches they differ in one corner, whose weight is a quarter both
  // at their middles and in the mean.
  const Vec3d apart = FaceCentre(b, vertices) - FaceCentre(a, vertices);
  const Vec3d area_a = AreaVector(a, vertices), area_b = AreaVector(b, vertices);
  const double edge = std::sqrt((Norm(area_a) + Norm(area_b)) / 2);
  return Dot(apart, Normalized(area_a - area_b)) >= kLeastNotchThickness * edge;
}

// Counts pairs at the vertex that comes second in the shared path, so each pair once per vertex
// of boundary degree two or more; only whether the count is zero matters.
void CountHangingFacesAt(const FaceCorner* corners, int count,
                         const std::vector<BoundaryFace>& boundary,
                         const std::vector<Vec3d>& vertices, BoundaryTopology& topology) {
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < i; ++k) {
      const OutwardFace& a = boundary[corners[i].face].face;
      const OutwardFace& b = boundary[corners[k].face].face;
      if (SharedVertices(a, b) >= 3 && FaceEachOther(a, b, vertices) &&
          !AreSidesOfNotch(a, b, vertices)) {
        ++topology.hanging_face_count;
      }
    }
  }
}

void ExamineComponents(const std::vector<BoundaryFace>& boundary,
                       const std::vector<Vec3d>& vertices, FaceSets& sets,
                       BoundaryTopology& topology) {
  struct Sum {
    double sixfold_volume = 0, area = 0;
    int64_t faces = 0;
  };
  std::vector<Sum> sums(boundary.size());
  for (size_t f = 0; f < boundary.size(); ++f) {
    const int32_t root = sets.Find(static_cast<int32_t>(f));
    const Vec3d origin = vertices[boundary[root].face.v[0]];
    Sum& sum = sums[root];
    sum.sixfold_volume += SixfoldConeVolume(boundary[f].face, vertices, origin);
    sum.area += Norm(AreaVector(boundary[f].face, vertices));
    ++sum.faces;
  }
  for (const Sum& sum : sums) {
    if (sum.faces == 0) continue;
    ++topology.component_count;
    const double thickness = std::abs(sum.sixfold_volume) / 3 / std::max(sum.area, 1e-300);
    const double mean_edge = std::sqrt(sum.area / static_cast<double>(sum.faces));
    if (!(thickness > kFlatPocketThickness * mean_edge)) ++topology.flat_pocket_count;
  }
}

}  // namespace

BoundaryTopology ExamineBoundary(const std::vector<BoundaryFace>& boundary,
                                 const std::vector<Vec3d>& vertices, const StopPoll& poll) {
  BoundaryTopology topology;
  const CornerTable table = GroupCorners(boundary, vertices.size());
  FaceSets sets(boundary.size());
  int64_t fan_count = 0;
  for (size_t v = 0; v < vertices.size(); ++v) {
    poll.At(static_cast<int64_t>(v));
    const FaceCorner* corners = table.corners.data() + table.begin[v];
    const int count = static_cast<int>(table.begin[v + 1] - table.begin[v]);
    if (count == 0) continue;
    ++topology.vertex_count;
    ExamineEdgesAt(static_cast<int32_t>(v), corners, count, sets, topology);
    const int fans = CountFans(corners, count);
    fan_count += fans;
    if (fans > 1) ++topology.non_manifold_vertex_count;
    CountHangingFacesAt(corners, count, boundary, vertices, topology);
  }
  poll.Now();
  ExamineComponents(boundary, vertices, sets, topology);
  // Euler: V - E + F = sum of (2 - 2 genus); touching sheets count as separate vertices.
  const int64_t euler = fan_count - topology.edge_count + static_cast<int64_t>(boundary.size());
  topology.genus = (2 * topology.component_count - euler) / 2;
  return topology;
}

double SixfoldConeVolume(const OutwardFace& face, const std::vector<Vec3d>& vertices,
                         const Vec3d& origin) {
  std::array<Vec3d, 4> p;
  for (int j = 0; j < face.count; ++j) p[j] = vertices[face.v[j]] - origin;
  if (face.count == 3) return Determinant(p[0], p[1], p[2]);
  return (Determinant(p[0], p[1], p[2]) + Determinant(p[0], p[2], p[3]) +
          Determinant(p[1], p[2], p[3]) + Determinant(p[1], p[3], p[0])) /
         2;
}

Vec3d AreaVector(const OutwardFace& face, const std::vector<Vec3d>& vertices) {
  const Vec3d &a = vertices[face.v[0]], &b = vertices[face.v[1]], &c = vertices[face.v[2]];
  if (face.count == 3) return Cross(b - a, c - a) / 2.0;
  return Cross(c - a, vertices[face.v[3]] - b) / 2.0;
}

Vec3d FaceCentre(const OutwardFace& face, const std::vector<Vec3d>& vertices) {
  Vec3d centre;
  for (int j = 0; j < face.count; ++j) centre += vertices[face.v[j]];
  return centre / static_cast<double>(face.count);
}

}  // namespace amhex
