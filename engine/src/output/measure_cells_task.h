// The measures of many cells: what crosses the border to the CUDA library that is loaded at run
// time.
#pragma once

#include <functional>
#include <vector>

#include "base/array_view.h"
#include "output/measure_cell.h"

namespace amhex {

// Views do not own.
struct CellsToMeasure {
  ArrayView<const CellCorners> corners;
  ArrayView<const Vec3d> vertices;

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(corners), visit(vertices);
  }
};

// Views are on host arrays that outlive the task.
struct MeasureCellsTask {
  CellsToMeasure cells;
  std::vector<CellMeasures> measures;  // out: by cell; as they were unless it was done
  std::function<bool()> should_stop;   // may be empty; asked from several threads
};

struct MeasureCellBody {
  CellsToMeasure cells;
  ArrayView<CellMeasures> measures;
  AMHEX_HD void operator()(int64_t c) const {
    measures[c] = MeasureCell(cells.corners[c], cells.vertices);
  }
};

}  // namespace amhex
