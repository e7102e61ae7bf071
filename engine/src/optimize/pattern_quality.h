// CellQuality (cell_quality.h) of a cell whose pattern is known; usable where bodies run.
#pragma once

#include <cmath>

#include "optimize/cell_measures.h"

namespace amhex {

AMHEX_HD inline double QualityOf(const CellPattern& pattern, const CellPositions& positions) {
  CornerJacobians jacobians;
  ScaledJacobians(pattern, positions, jacobians);
  double quality = 1.0;
  for (int i = 0; i < pattern.corner_count; ++i) {
    if (!std::isfinite(jacobians[i])) return -1.0;
    quality = Lesser(quality, jacobians[i]);
  }
  // Any violation makes the value non-positive; the worst one names it.
  const double margin = FoldMargin(pattern, positions);
  if (margin > 0) return quality;
  const double violation = margin < -1.0 ? -1.0 : margin;
  return Lesser(Lesser(quality, 0.0), violation);
}

}  // namespace amhex
