// What placement keeps of every cell between the visits of vertices; usable where bodies run.
#pragma once

#include <cstdint>

#include "optimize/cell_energy.h"
#include "optimize/cell_measures.h"
#include "optimize/placement_view.h"

namespace amhex {

// Brings the survey of one cell up to date.
AMHEX_HD inline void SurveyCell(const PlacementView& placement, int64_t c) {
  const CellPattern& pattern = placement.PatternOf(c);
  CellPositions positions;
  for (int slot = 0; slot < 8; ++slot)
    positions[slot] = placement.vertices[placement.cells[c][slot]];
  CornerJacobians jacobians;
  ScaledJacobians(pattern, positions, jacobians);
  double minimum = jacobians[0];
  for (int i = 1; i < pattern.corner_count; ++i) {
    if (jacobians[i] < minimum) minimum = jacobians[i];
  }
  placement.min_scaled_jacobian[c] = static_cast<float>(minimum);
  placement.near_folding[c] = FoldMargin(pattern, positions) < kNearFolding;
}

}  // namespace amhex
