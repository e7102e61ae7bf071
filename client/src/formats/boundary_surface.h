// The surface around a volume mesh.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/volume_mesh.h"
#include "cells/cells.h"

namespace amhex::client {

struct PolygonSurface {
  std::vector<Vec3d> vertices;  // those on the boundary, in the order of the mesh
  std::vector<Face> faces;      // outward, numbered by `vertices`
};

// DATA_LOSS if the cells do not fit together.
absl::StatusOr<PolygonSurface> BoundarySurface(const AtMostHexaMesh& mesh);

// Quadrilaterals are cut along the diagonal that bends their halves least.
TriangleMesh Triangulated(const PolygonSurface& surface);

// Writes by extension: .ply and .obj with the quadrilaterals as they are, the others triangulated;
// .drc so that no vertex moves by more than 1/200 of the mean edge.
absl::Status WriteBoundarySurface(const AtMostHexaMesh& mesh, const std::string& path);

}  // namespace amhex::client
