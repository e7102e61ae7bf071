#include "optimize/cell_quality.h"

#include "optimize/pattern_quality.h"

namespace amhex {

double CellQuality(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  const CellPattern* pattern = FindCellPattern(corners);
  if (pattern == nullptr) return -1.0;
  CellPositions positions;
  for (int slot = 0; slot < 8; ++slot) positions[slot] = vertices[corners[slot]];
  return QualityOf(*pattern, positions);
}

}  // namespace amhex
