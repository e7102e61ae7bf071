// The volume of a cell by its 8 corners; usable where bodies run.
#pragma once

#include <array>
#include <cmath>

#include "amhex/vec3.h"

namespace amhex {

// Exact for the trilinear map (2x2x2 Gauss points).
AMHEX_HD inline double TrilinearVolume(const std::array<Vec3d, 8>& x) {
  constexpr int kSign[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                               {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  const double g = 1.0 / std::sqrt(3.0);
  double volume = 0;
  for (const auto& point : kSign) {
    const double u = point[0] * g, v = point[1] * g, w = point[2] * g;
    Vec3d du, dv, dw;
    for (int i = 0; i < 8; ++i) {
      const double a = 1 + kSign[i][0] * u, b = 1 + kSign[i][1] * v, c = 1 + kSign[i][2] * w;
      du += x[i] * (kSign[i][0] * b * c / 8);
      dv += x[i] * (a * kSign[i][1] * c / 8);
      dw += x[i] * (a * b * kSign[i][2] / 8);
    }
    volume += Determinant(du, dv, dw);
  }
  return volume;
}

}  // namespace amhex
