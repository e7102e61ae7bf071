// What runs cost, as measured; shared by the estimate and by the check at a run's start.
#pragma once

#include <cstdint>

namespace amhex {

// Seconds on the CPU backend with two threads, from docs/results.md: chosen so that most
// models there are near; clouds of organic shapes take up to four times as long. Boxy solids and
// organic ones, which leave much to close and to place, lie up to five times apart at the same
// number of cells.
inline constexpr double kSecondsPerCell = 0.30e-3;
inline constexpr double kSecondsPerCellAndTrial = 0.10e-3;
// Twistcube of 1,300 cells from a grid start: 1.2 s of relaxation, 150 iterations.
inline constexpr double kSecondsPerCellAndIteration = 6e-6;
// Triangles or points; clouds cost more, large meshes less.
inline constexpr double kSecondsPerInputElement = 1e-5;
// Of a volume mesh that is reassembled or subdivided: nothing is relaxed.
inline constexpr double kSecondsPerGivenCell = 3e-5;
// Memory is the process's peak, and an upper bound: runs are refused for it.
inline constexpr int64_t kBytesPerCell = 8'000;
inline constexpr int64_t kBytesPerInputElement = 600;
inline constexpr int64_t kBytesAtRest = 50'000'000;

// `input_elements` counts triangles or points.
inline constexpr int64_t ExpectedMemoryBytes(int64_t cell_count, int64_t input_elements) {
  return kBytesAtRest + kBytesPerCell * cell_count + kBytesPerInputElement * input_elements;
}

struct ExpectedWork {
  int64_t cell_count = 0;
  int64_t input_elements = 0;
  int trial_count = 1;
  int iteration_count = 0;
};

inline constexpr double ExpectedSeconds(const ExpectedWork& work) {
  const double per_cell = kSecondsPerCell + kSecondsPerCellAndTrial * work.trial_count +
                          kSecondsPerCellAndIteration * work.iteration_count;
  return per_cell * static_cast<double>(work.cell_count) +
         kSecondsPerInputElement * static_cast<double>(work.input_elements);
}

// The largest of the fields' solves on a device, of the phases (fields/phase_impl.h), in bytes per
// node of the background grid: four vectors of six floats and two of half the nodes 120, turns 72,
// the hull's wishes 36, edges 1, the order and its links 35; and of what stays there meanwhile
// (fields/lattice_task.h): cells 8, links 27, frames and sizes 56, closed increments 36.
inline constexpr int64_t kDeviceBytesPerNode = 391;
// Nodes of the background grid, half an edge length apart.
inline constexpr int64_t kNodesPerCell = 8;

inline constexpr int64_t ExpectedFieldBytes(int64_t cell_count) {
  return kDeviceBytesPerNode * kNodesPerCell * cell_count;
}
// Of vertex placement there: the cells around the vertices of the largest colour, about one in
// eight, and the arrays of cells, vertices and what joins them.
inline constexpr int64_t kDeviceBytesPerPlacedCell = 700;
// Per triangle of the hull, which stays there from its first query to the end of the run: corners
// and normal 100, and 0.75 nodes of 168. Its patches lie beside it while vertices are placed.
inline constexpr int64_t kDeviceBytesPerTriangle = 226;
inline constexpr int64_t kDeviceBytesPerPatchTriangle = 148;

}  // namespace amhex
