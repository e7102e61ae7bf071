// Grids of merged cubes built by code, as section 5.1 would hand them over.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/vec3.h"
#include "geometry/merged_cubes.h"
#include "topology/primitives.h"

namespace amhex::testing {

// Cubes of edge length 1 on [0, nx] x [0, ny] x [0, nz], all neighbours matched, the outside on
// the hull.
inline MergedCubes MakeCubeGrid(int nx, int ny, int nz) {
  constexpr int kCorner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                 {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  const std::array<int, 3> size = {nx, ny, nz};
  MergedCubes cubes;
  const auto vertex = [&](int x, int y, int z) { return (z * (ny + 1) + y) * (nx + 1) + x; };
  const auto cube = [&](int x, int y, int z) { return (z * ny + y) * nx + x; };
  for (int z = 0; z <= nz; ++z) {
    for (int y = 0; y <= ny; ++y) {
      for (int x = 0; x <= nx; ++x) {
        cubes.vertices.push_back({double(x), double(y), double(z)});
        cubes.on_hull.push_back(x == 0 || x == nx || y == 0 || y == ny || z == 0 || z == nz);
      }
    }
  }
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x) {
        CellCorners corners;
        for (int c = 0; c < 8; ++c) {
          corners[c] = vertex(x + kCorner[c][0], y + kCorner[c][1], z + kCorner[c][2]);
        }
        cubes.corners.push_back(corners);
        uint8_t hull = 0;
        std::array<int32_t, 6> matches;
        for (int d = 0; d < 6; ++d) {
          std::array<int, 3> at = {x, y, z};
          at[d / 2] += d % 2 == 0 ? -1 : 1;
          const bool outside = at[d / 2] < 0 || at[d / 2] >= size[d / 2];
          if (outside) hull = static_cast<uint8_t>(hull | 1 << d);
          matches[d] = outside ? -1 : 6 * cube(at[0], at[1], at[2]) + (d ^ 1);
        }
        cubes.hull_faces.push_back(hull);
        cubes.matches.push_back(matches);
      }
    }
  }
  return cubes;
}

}  // namespace amhex::testing
