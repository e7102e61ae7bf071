#include "optimize/report_cells.h"

#include "optimize/cell_pattern.h"
#include "optimize/raise_quality.h"

namespace amhex {

CellCounts CountCells(const CellComplex& complex) {
  CellCounts counts{};
  for (const CellCorners& corners : complex.cells) {
    const CellPattern* pattern = FindCellPattern(corners);
    if (pattern != nullptr) ++counts[static_cast<size_t>(pattern->type)];
  }
  return counts;
}

void ReportCells(const CellComplex& complex, RunContext& run) {
  Progress progress = run.progress();
  progress.cell_count = static_cast<int64_t>(complex.cells.size());
  progress.cells_by_type = CountCells(complex);
  const QualitySummary quality = SummarizeQuality(complex);
  const bool any = !complex.cells.empty();
  progress.min_scaled_jacobian = any ? quality.min_scaled_jacobian : 0;
  progress.average_scaled_jacobian = any ? quality.average_scaled_jacobian : 0;
  run.Report(progress);
}

}  // namespace amhex
