// Delaunay tetrahedra of points in space, by exact integer predicates.
//
// Points are snapped to a fine lattice and jittered by a few lattice units (deterministically), so
// that cubes' corners are never cospherical; the structure is exactly Delaunay for the snapped
// points, and for the given ones up to about 1e-6 of their box.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {

struct Tetrahedra {
  static constexpr int32_t kInfinite = -1;  // the vertex beyond the convex hull
  // [tetrahedron] point ids, positively oriented: Determinant(b - a, c - a, d - a) > 0. One id is
  // kInfinite outside the convex hull.
  std::vector<std::array<int32_t, 4>> vertices;
  // [tetrahedron] the neighbour opposite each vertex.
  std::vector<std::array<int32_t, 4>> neighbours;

  int count() const { return static_cast<int>(vertices.size()); }
  bool IsFinite(int t) const {
    const auto& v = vertices[t];
    return v[0] >= 0 && v[1] >= 0 && v[2] >= 0 && v[3] >= 0;
  }
};

// Tetrahedralises at least four points that are not coplanar; an empty result otherwise. Points
// closer than about 1e-6 of the box count as one and the later is left out. O(n log n) expected.
Tetrahedra DelaunayTetrahedralization(const std::vector<Vec3d>& points, uint64_t seed);

}  // namespace amhex
