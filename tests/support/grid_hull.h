// The hull of the box that a grid of unit cubes fills.
#pragma once

#include "fixtures/solids.h"
#include "support/grid_complex.h"
#include "support/hull_of_mesh.h"

namespace amhex::testing_support {

// `spacing`: of the triangles' corners.
inline Hull GridHull(const GridSize& n, double spacing) {
  const Vec3d extent{static_cast<double>(n.nx), static_cast<double>(n.ny),
                     static_cast<double>(n.nz)};
  return HullOfMesh(fixtures::MakeBox(extent, spacing));
}

}  // namespace amhex::testing_support
