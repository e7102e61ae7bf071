// A hull with a ridge that need not run along the edges of the cubes below it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "support/grid_complex.h"
#include "support/hull_of_mesh.h"

namespace amhex::testing_support {

// A box whose top bears a roof along y, one edge length to either side of `ridge_x`.
struct Roof {
  double ridge_x = 0;
  double height = 0;
  GridSize size = {6, 4, 3};
  double At(double x) const { return height * std::max(0.0, 1 - std::abs(x - ridge_x)); }
};

inline Hull HullUnder(const Roof& roof) {
  TriangleMesh mesh;
  const double stations[] = {0, roof.ridge_x - 1, roof.ridge_x, roof.ridge_x + 1,
                             double(roof.size.nx)};
  for (const double y : {0.0, double(roof.size.ny)}) {
    for (const double x : stations) {
      mesh.vertices.push_back({x, y, 0});
      mesh.vertices.push_back({x, y, roof.size.nz + roof.At(x)});
    }
  }
  const auto add_quad = [&](int32_t a, int32_t b, int32_t c, int32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  constexpr int32_t kBack = 10;  // behind the vertices of the front
  for (int32_t low = 0; low < 8; low += 2) {
    const int32_t high = low + 1;
    add_quad(low, low + 2, high + 2, high);
    add_quad(kBack + low, kBack + high, kBack + high + 2, kBack + low + 2);
    add_quad(low, kBack + low, kBack + low + 2, low + 2);
    add_quad(high, high + 2, kBack + high + 2, kBack + high);
  }
  add_quad(0, 1, kBack + 1, kBack);
  add_quad(8, kBack + 8, kBack + 9, 9);
  return HullOfMesh(mesh);
}

// Cubes whose uppermost vertices were lifted onto the roof: none is on the ridge.
inline CellComplex CubesUnder(const Roof& roof) {
  CellComplex complex = GridComplex(roof.size);
  for (Vec3d& p : complex.vertices) {
    if (p.z == roof.size.nz) p.z += roof.At(p.x);
  }
  return complex;
}

}  // namespace amhex::testing_support
