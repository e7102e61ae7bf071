// Which cells and hull faces use a vertex, and which vertices may move at the same time.
#pragma once

#include <cstdint>
#include <vector>

#include "assembly/cell_complex.h"
#include "base/stop_poll.h"
#include "optimize/cell_pattern.h"

namespace amhex {

// Compressed rows: the items of row i are item[begin[i] .. begin[i + 1]), ascending.
struct Incidence {
  std::vector<int64_t> begin;  // [row_count + 1]
  std::vector<int32_t> item;

  struct Row {
    const int32_t* first;
    const int32_t* last;
    const int32_t* begin() const { return first; }
    const int32_t* end() const { return last; }
    int64_t size() const { return last - first; }
  };
  Row operator[](int64_t row) const {
    return {item.data() + begin[row], item.data() + begin[row + 1]};
  }
};

struct VertexNeighbourhoods {
  std::vector<int16_t> patterns;  // [cell_count] index into AllCellPatterns()
  Incidence cells;                // vertex -> cells
  Incidence hull_faces;           // vertex -> hull faces
  // Vertices by colour: no two of one colour share a cell, so that all of one colour can be moved
  // in parallel with a result that does not depend on the order.
  std::vector<std::vector<int32_t>> colours;
  std::vector<int32_t> colour_of;  // [vertex] -1 without cells
};

// Linear. Requires cells of Figure 2. Throws RunStopped when `poll` does.
VertexNeighbourhoods FindNeighbourhoods(const CellComplex& complex, const StopPoll& poll = {});

}  // namespace amhex
