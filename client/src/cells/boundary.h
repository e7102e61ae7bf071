// Faces of a mesh that only one cell has.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/volume_mesh.h"
#include "cells/cells.h"

namespace amhex::client {

struct BoundaryFace {
  Face face;         // outward
  int32_t cell = 0;  // whose face it is
};

// In order of cells. Only cells with `keep[cell]` count; an empty `keep` keeps all.
// DATA_LOSS if a face belongs to more than two cells, or to two that orient it alike.
absl::StatusOr<std::vector<BoundaryFace>> BoundaryOf(const AtMostHexaMesh& mesh,
                                                     const std::vector<bool>& keep);

}  // namespace amhex::client
