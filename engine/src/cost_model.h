// What runs cost, as measured; shared by the estimate and by the check at a run's start.
#pragma once

#include <cstdint>

namespace amhex {

// Models of 1.5k to 12k cells, CPU backend, one core; memory is the process's peak.
inline constexpr double kSecondsPerCell = 2e-3;
inline constexpr double kSecondsPerInputElement = 2e-5;
inline constexpr int64_t kBytesPerCell = 8'000;
inline constexpr int64_t kBytesPerInputElement = 600;
inline constexpr int64_t kBytesAtRest = 50'000'000;

// `input_elements` counts triangles or points.
inline constexpr int64_t ExpectedMemoryBytes(int64_t cell_count, int64_t input_elements) {
  return kBytesAtRest + kBytesPerCell * cell_count + kBytesPerInputElement * input_elements;
}

inline constexpr double ExpectedSeconds(int64_t cell_count, int64_t input_elements) {
  return kSecondsPerCell * static_cast<double>(cell_count) +
         kSecondsPerInputElement * static_cast<double>(input_elements);
}

// The largest of the fields' solves on a device, of the closed lattice form
// (fields/gradient_impl.h), in bytes per node of the background grid: links 27, which numbers are
// closed and follow the hull 3, six vectors of nine floats 216, curls 36.
inline constexpr int64_t kDeviceBytesPerNode = 282;
// Nodes of the background grid, half an edge length apart.
inline constexpr int64_t kNodesPerCell = 8;

inline constexpr int64_t ExpectedFieldBytes(int64_t cell_count) {
  return kDeviceBytesPerNode * kNodesPerCell * cell_count;
}
// Of vertex placement there: the cells around the vertices of the largest colour, about one in
// eight, and the arrays of cells, vertices and what joins them.
inline constexpr int64_t kDeviceBytesPerPlacedCell = 700;

}  // namespace amhex
