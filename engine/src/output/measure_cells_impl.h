// Measures the cells of measure_cells_task.h with arrays where bodies run.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/uploaded_arrays.h"
#include "output/measure_cells_task.h"

namespace amhex {

// Memory where bodies run.
template <class E>
int64_t MeasureCellsBytes(const MeasureCellsTask& task) {
  return UploadedArrays<E>::Bytes(task.cells) +
         task.cells.corners.size * static_cast<int64_t>(sizeof(CellMeasures));
}

// False if it was stopped.
template <class E>
bool MeasureAll(E& executor, MeasureCellsTask& task) {
  const int64_t count = task.cells.corners.size;
  UploadedArrays<E> arrays(executor);
  const CellsToMeasure cells = arrays.Upload(task.cells);
  Buffer<E, CellMeasures> measures = executor.template Alloc<CellMeasures>(count);
  executor.ForEach("measure cells", count, MeasureCellBody{cells, measures.View()});
  std::vector<CellMeasures> host(static_cast<size_t>(count));
  executor.CopyOut(measures, count, host.data());
  if (executor.Stopped()) return false;
  task.measures = std::move(host);
  return true;
}

}  // namespace amhex
