// Cells of a wedge that end some way before its edge.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "support/grid_complex.h"

namespace amhex::testing_support {

// fixtures::MakeWedge(degrees, begin + n.nx, n.ny) filled from x = `begin` on, the wall there open.
inline CellComplex WedgeComplex(double degrees, double begin, const GridSize& n) {
  CellComplex complex = GridComplex(n);
  const double slope = std::tan(degrees * std::numbers::pi / 180);
  for (Vec3d& p : complex.vertices) {
    p.x += begin;
    p.z *= p.x * slope / n.nz;
  }
  std::erase_if(complex.hull_faces, [&](const CellFace& face) {
    return std::all_of(face.v.begin(), face.v.end(),
                       [&](int32_t v) { return complex.vertices[v].x == begin; });
  });
  return complex;
}

}  // namespace amhex::testing_support
