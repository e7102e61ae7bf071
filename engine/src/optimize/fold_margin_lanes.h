// FoldMargin (cell_measures.h) in lanes, with the same bits. On the host only.
#pragma once

#include <array>
#include <cmath>

#include "base/vector_lanes.h"
#include "optimize/cell_measures.h"

namespace amhex {

using FourCells = std::array<VectorsOf<kHalfLanes>, 8>;  // their corners, by slot

// Of four cells of one pattern. For use inside of RunWithWidestVectors.
AMHEX_LANES_INLINE HalfLanes FoldMarginsOf(const CellPattern& pattern, const FourCells& corner) {
  HalfLanes length_sum{};
  for (int e = 0; e < pattern.edge_count; ++e) {
    const auto& slots = pattern.edge_slots[e];
    const VectorsOf<kHalfLanes> along = corner[slots[1]] - corner[slots[0]];
    length_sum += SquareRoot(along.Dot(along));
  }
  const HalfLanes mean_length = length_sum / static_cast<double>(pattern.edge_count);
  const HalfLanes unit = mean_length * mean_length * mean_length;
  HalfLanes determinant = HalfLanes{} + kNoDeterminant;
  GaussJacobians<VectorsOf<kHalfLanes>>(corner).LowerTo(determinant);
  if (pattern.type != PrimitiveType::kSlice) LowerToStar(pattern, corner, determinant);
  HalfLanes margin = determinant / unit - kSmallestDeterminant;
  for (int lane = 0; lane < kHalfLanes; ++lane) {
    margin[lane] = std::isfinite(margin[lane]) ? margin[lane] : -1.0;
  }
  return margin;
}

}  // namespace amhex
