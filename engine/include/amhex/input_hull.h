// What a client hands to the mesher: a surface mesh or a point cloud, in its own units.
#pragma once

#include <array>
#include <cstdint>
#include <variant>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {

// A triangle soup; closed or open, any number of components. Orientation is outward where closed.
struct TriangleMesh {
  std::vector<Vec3d> vertices;                    // [vertex_count] the user's units
  std::vector<std::array<int32_t, 3>> triangles;  // [triangle_count] indices into vertices
};

// Surface samples. Normals point outward; they need not have unit length.
struct PointCloud {
  std::vector<Vec3d> points;   // [point_count] the user's units
  std::vector<Vec3d> normals;  // [point_count], or empty when the scan has none
};

using InputHull = std::variant<TriangleMesh, PointCloud>;

}  // namespace amhex
