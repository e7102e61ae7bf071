// Cells of a wedge or spike that end some way before its edge or tip.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "support/grid_complex.h"

namespace amhex::testing_support {

// What is at x = `begin` is no longer on the hull.
inline void OpenWall(double begin, CellComplex& complex) {
  std::erase_if(complex.hull_faces, [&](const CellFace& face) {
    return std::all_of(face.v.begin(), face.v.end(),
                       [&](int32_t v) { return complex.vertices[v].x == begin; });
  });
}

// fixtures::MakeWedge(degrees, begin + n.nx, n.ny) filled from x = `begin` on, the wall there open.
inline CellComplex WedgeComplex(double degrees, double begin, const GridSize& n) {
  CellComplex complex = GridComplex(n);
  const double slope = std::tan(degrees * std::numbers::pi / 180);
  for (Vec3d& p : complex.vertices) {
    p.x += begin;
    p.z *= p.x * slope / n.nz;
  }
  OpenWall(begin, complex);
  return complex;
}

// fixtures::MakeSpike(degrees, begin + n.nx) likewise.
inline CellComplex SpikeComplex(double degrees, double begin, const GridSize& n) {
  CellComplex complex = GridComplex(n);
  const double slope = std::tan(degrees / 2 * std::numbers::pi / 180);
  for (Vec3d& p : complex.vertices) {
    p.x += begin;
    p.y = (2 * p.y / n.ny - 1) * p.x * slope;
    p.z = (2 * p.z / n.nz - 1) * p.x * slope;
  }
  OpenWall(begin, complex);
  return complex;
}
}  // namespace amhex::testing_support
