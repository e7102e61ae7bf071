// Points for the tests of neighbour searches.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "base/counter_rng.h"
#include "base/platform.h"

namespace amhex {

// Uniform in [0, extent]^3.
inline std::vector<Vec3f> RandomPoints(uint64_t seed, int count, double extent) {
  std::vector<Vec3f> points;
  for (uint64_t i = 0; i < static_cast<uint64_t>(count); ++i) {
    points.push_back(ToFloat(Vec3d{RandomUnit(seed, RandomStream::kGridJitter, 3 * i),
                                   RandomUnit(seed, RandomStream::kGridJitter, 3 * i + 1),
                                   RandomUnit(seed, RandomStream::kGridJitter, 3 * i + 2)} *
                             extent));
  }
  return points;
}

// Centres of width^3 unit cubes; point (x, y, z) has the id (z * width + y) * width + x.
inline std::vector<Vec3f> GridPoints(int width) {
  std::vector<Vec3f> points;
  for (int z = 0; z < width; ++z) {
    for (int y = 0; y < width; ++y) {
      for (int x = 0; x < width; ++x) {
        points.push_back(ToFloat(Vec3d{x + 0.5, y + 0.5, z + 0.5}));
      }
    }
  }
  return points;
}

}  // namespace amhex
