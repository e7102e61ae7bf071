// A box whose top has points that no vertex of a grid reaches.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "amhex/input_hull.h"
#include "input/hull.h"
#include "support/grid_complex.h"
#include "support/hull_of_mesh.h"

namespace amhex::testing_support {

inline constexpr GridSize kStuddedSize = {9, 9, 4};

// A box of unit cubes with a point above, or below, the middle of some faces of its top.
struct Studs {
  std::vector<std::array<int, 2>> at;  // the faces' least corners
  double height = 0;
  double height_of_first = height;
};

inline Hull HullWith(const Studs& studs) {
  TriangleMesh mesh;
  const int nx = kStuddedSize.nx, ny = kStuddedSize.ny;
  const auto id = [&](int x, int y, int layer) { return (layer * (ny + 1) + y) * (nx + 1) + x; };
  for (const int z : {0, kStuddedSize.nz}) {
    for (int y = 0; y <= ny; ++y) {
      for (int x = 0; x <= nx; ++x) mesh.vertices.push_back({double(x), double(y), double(z)});
    }
  }
  const auto add_quad = [&](int32_t a, int32_t b, int32_t c, int32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) {
      add_quad(id(x, y, 0), id(x, y + 1, 0), id(x + 1, y + 1, 0), id(x + 1, y, 0));
      const int32_t loop[] = {id(x, y, 1), id(x + 1, y, 1), id(x + 1, y + 1, 1), id(x, y + 1, 1)};
      if (std::find(studs.at.begin(), studs.at.end(), std::array{x, y}) == studs.at.end()) {
        add_quad(loop[0], loop[1], loop[2], loop[3]);
        continue;
      }
      const auto tip = static_cast<int32_t>(mesh.vertices.size());
      const bool is_first = studs.at.front() == std::array{x, y};
      const double height = is_first ? studs.height_of_first : studs.height;
      mesh.vertices.push_back({x + 0.5, y + 0.5, kStuddedSize.nz + height});
      for (int j = 0; j < 4; ++j) mesh.triangles.push_back({loop[j], loop[(j + 1) % 4], tip});
    }
  }
  for (int x = 0; x < nx; ++x) {
    add_quad(id(x, 0, 0), id(x + 1, 0, 0), id(x + 1, 0, 1), id(x, 0, 1));
    add_quad(id(x, ny, 0), id(x, ny, 1), id(x + 1, ny, 1), id(x + 1, ny, 0));
  }
  for (int y = 0; y < ny; ++y) {
    add_quad(id(0, y, 0), id(0, y, 1), id(0, y + 1, 1), id(0, y + 1, 0));
    add_quad(id(nx, y, 0), id(nx, y + 1, 0), id(nx, y + 1, 1), id(nx, y, 1));
  }
  return HullOfMesh(mesh);
}

// On every `step`-th face along both sides, from face `first` on.
inline Studs StudsAllOver(double height, int first, int step) {
  Studs studs{{}, height, height};
  for (int x = first; x < kStuddedSize.nx; x += step) {
    for (int y = first; y < kStuddedSize.ny; y += step) studs.at.push_back({x, y});
  }
  return studs;
}

}  // namespace amhex::testing_support
