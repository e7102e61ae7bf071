// What a client hands to the mesher: a surface mesh, a point cloud or a volume mesh, in its own
// units, and what may guide the cells inside it.
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

// Cells bounded by polygons: tetrahedra, hexahedra or any other polyhedra. Every cell lists all its
// faces, so that a face between two cells appears twice. Faces may run in either direction.
struct VolumeMesh {
  std::vector<Vec3d> vertices;        // [vertex_count] the user's units
  std::vector<int32_t> cell_faces;    // [cell_count] how many faces each cell has
  std::vector<int32_t> face_corners;  // [face_count] how many corners each face has, cell by cell
  std::vector<int32_t>
      corners;  // [corner_count] indices into vertices, face by face, in ring order
};

using InputHull = std::variant<TriangleMesh, PointCloud, VolumeMesh>;

// What aligns cells without bounding them (section 6.2, "Guidance"): directions that one axis of
// the cells nearby should follow, up to sign.
struct GuideSample {
  Vec3d position;     // the user's units
  Vec3d axis;         // any length but zero
  Vec3d second_axis;  // about perpendicular to `axis`; zero when only one axis is given
};

// A plane through the solid, like one of dual-sheet meshing: cells align to it on both sides.
struct GuidePlane {
  Vec3d point;   // the user's units
  Vec3d normal;  // any length but zero
};

struct Guidance {
  std::vector<GuideSample> samples;
  std::vector<GuidePlane> planes;
  bool empty() const { return samples.empty() && planes.empty(); }
};

struct MeshingInput {
  InputHull hull;
  Guidance guidance;
};

}  // namespace amhex
