// Every face of a mesh, paired: the interior, the boundary, and what breaks conformity.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/volume_mesh.h"
#include "base/stop_poll.h"
#include "output/cell_law.h"

namespace amhex {

struct BoundaryFace {
  OutwardFace face;
  int32_t cell = -1;
};

struct FaceCensus {
  std::vector<BoundaryFace> boundary;  // in the order of cells, then of faces within a cell
  int64_t interior_count = 0;          // shared by two cells with opposite orientation
  int64_t same_side_count = 0;         // shared by two cells without opposite orientation
  int64_t overused_count = 0;          // vertex sets that are faces of more than two cells
};

// Requires corner indices in [0, vertex_count). Linear in the number of cells. Here and below,
// RunStopped is thrown when `poll` does.
FaceCensus CountFaces(const std::vector<CellCorners>& cells, int64_t vertex_count,
                      const StopPoll& poll = {});

// Number of cells whose set of vertices is that of an earlier cell. Linear.
int64_t CountDuplicateCells(const std::vector<CellCorners>& cells, int64_t vertex_count,
                            const StopPoll& poll = {});

}  // namespace amhex
