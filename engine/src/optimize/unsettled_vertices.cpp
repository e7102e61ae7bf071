#include "optimize/unsettled_vertices.h"

#include <cstdint>
#include <vector>

#include "assembly/new_cells.h"

namespace amhex {

ActiveVertices UnsettledVertices(const Placement& placement, const CellComplex& settled,
                                 const StopPoll& poll) {
  const CellComplex& complex = placement.complex;
  const std::vector<uint8_t> at_new_cell = VerticesOfNewCells(complex, settled, poll);
  ActiveVertices unsettled = ActiveVertices::None(static_cast<int64_t>(complex.vertices.size()));
  for (size_t v = 0; v < at_new_cell.size(); ++v) {
    poll.At(static_cast<int64_t>(v));
    if (at_new_cell[v] == 0) continue;
    for (const int32_t c : placement.neighbourhoods.cells[static_cast<int64_t>(v)]) {
      for (const int32_t corner : complex.cells[c]) unsettled.Add(corner);
    }
  }
  return unsettled;
}

}  // namespace amhex
