#include "reassembly/merged_quads.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "topology/half_face.h"

namespace amhex {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// A triangle as seen from one of its edges.
struct EdgeTriangle {
  std::array<int32_t, 2> edge;  // the smaller vertex first
  int32_t apex;
  bool on_hull;

  friend bool operator<(const EdgeTriangle& a, const EdgeTriangle& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.apex < b.apex;
  }
};

std::vector<CellFace> TrianglesOf(const BrokenVolume& volume) {
  std::vector<CellFace> triangles;
  for (const CellCorners& cell : volume.cells) {
    for (const CellFace& face : FacesOf(cell)) {
      if (face.count == 3) triangles.push_back(StandingHalfFace(face));
    }
  }
  tbb::parallel_sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

std::vector<CellFace> HullTriangles(const BrokenVolume& volume) {
  std::vector<CellFace> triangles;
  for (const CellFace& face : volume.boundary) {
    if (face.count == 3) triangles.push_back(StandingHalfFace(face));
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

std::vector<EdgeTriangle> ByEdge(const BrokenVolume& volume) {
  const std::vector<CellFace> hull = HullTriangles(volume);
  std::vector<EdgeTriangle> result;
  for (const CellFace& t : TrianglesOf(volume)) {
    const bool on_hull = std::binary_search(hull.begin(), hull.end(), t);
    for (int i = 0; i < 3; ++i) {
      const int32_t a = t.v[i], b = t.v[(i + 1) % 3];
      result.push_back({{std::min(a, b), std::max(a, b)}, t.v[(i + 2) % 3], on_hull});
    }
  }
  tbb::parallel_sort(result.begin(), result.end());
  return result;
}

// Cosines: of the angles the largest, of the fold the least.
struct FairQuad {
  double corner;
  double fold;
};

bool IsFair(const CellFace& quad, const std::vector<Vec3d>& vertices, const FairQuad& fair) {
  const auto at = [&](int i) { return vertices[static_cast<size_t>(quad.v[i % 4])]; };
  for (int i = 0; i < 4; ++i) {
    const double cosine = Dot(Normalized(at(i + 1) - at(i)), Normalized(at(i + 3) - at(i)));
    if (std::abs(cosine) > fair.corner) return false;
  }
  // The ring is a, one apex, b, the other apex; a and b are the common edge's.
  const Vec3d first = Normalized(Cross(at(1) - at(0), at(2) - at(0)));
  const Vec3d second = Normalized(Cross(at(2) - at(0), at(3) - at(0)));
  return Dot(first, second) >= fair.fold;
}

}  // namespace

std::vector<CellFace> FindMergedQuads(const BrokenVolume& volume, const QuadLimits& limits) {
  const double corner = std::cos(limits.corner * kDegree);
  const FairQuad inside{corner, std::cos(limits.inner_fold * kDegree)};
  const FairQuad on_hull{corner, std::cos(limits.hull_fold * kDegree)};
  const std::vector<EdgeTriangle> sides = ByEdge(volume);
  std::vector<CellFace> quads;
  for (size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].edge == sides[begin].edge) ++end;
    for (size_t i = begin; i < end; ++i) {
      for (size_t j = i + 1; j < end; ++j) {
        if (sides[i].on_hull != sides[j].on_hull) continue;
        const auto [a, b] = sides[i].edge;
        const CellFace quad = {4, {a, sides[i].apex, b, sides[j].apex}};
        const FairQuad& fair = sides[i].on_hull ? on_hull : inside;
        if (IsFair(quad, volume.vertices, fair)) quads.push_back(StandingHalfFace(quad));
      }
    }
  }
  tbb::parallel_sort(quads.begin(), quads.end());
  quads.erase(std::unique(quads.begin(), quads.end()), quads.end());
  return quads;
}

}  // namespace amhex
