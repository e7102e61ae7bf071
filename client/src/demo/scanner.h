// A simulated scan: rays from several positions around a shape, with noise.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "demo/shapes.h"

namespace amhex::client {

// Scanner positions: along the six axes and the eight diagonals, so that each part of the surface
// is seen by some unless it hides from all.
inline constexpr int kScannerCount = 14;

struct ScanOptions {
  int64_t point_count = 30'000;  // [100, 10'000'000]
  // Standard deviation of the position noise per axis, in the shape's units; -1 = 0.0003 of the
  // box's diagonal. Noise is cut off at three deviations.
  double noise = -1;
  double normal_noise = 0.02;  // [0, 1] deviation of the unit normals per axis
  uint64_t seed = 1;           // same seed, same scan
};

struct Scan {
  PointCloud cloud;                 // with outward normals
  std::vector<int32_t> scanner_of;  // [point_count] which position saw the point
  double noise = 0;                 // the deviation used
};

// INVALID_ARGUMENT naming the option, its value and range. A point is recorded where a ray first
// meets the surface, unless it grazes it by less than about 12 degrees.
absl::StatusOr<Scan> ScanShape(const Shape& shape, const ScanOptions& options);

}  // namespace amhex::client
