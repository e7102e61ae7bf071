#include "optimize/cell_quality.h"

#include <algorithm>
#include <cmath>

namespace amhex {
double CellQuality(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  const CellPattern* pattern = FindCellPattern(corners);
  if (pattern == nullptr) return -1.0;
  std::array<Vec3d, 8> positions;
  for (int slot = 0; slot < 8; ++slot) positions[slot] = vertices[corners[slot]];
  CornerJacobians jacobians;
  ScaledJacobians(*pattern, positions, jacobians);
  double quality = 1.0;
  for (int i = 0; i < pattern->corner_count; ++i) {
    if (!std::isfinite(jacobians[i])) return -1.0;
    quality = std::min(quality, jacobians[i]);
  }
  // Any violation makes the value non-positive; the worst one names it.
  const double margin = FoldMargin(*pattern, positions);
  return margin > 0 ? quality : std::min({quality, 0.0, std::max(margin, -1.0)});
}

}  // namespace amhex
