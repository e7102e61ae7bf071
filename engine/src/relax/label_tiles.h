// Runs the labelling of all tiles on an executor.
#pragma once

#include <cstdint>

#include "relax/label_body.h"

namespace amhex {

// One element per tile and side; the CUDA executor has an overload of its own (label_tiles.cuh).
template <class E>
void LabelTiles(E& executor, const LabelTileBody& body, int64_t item_count) {
  executor.ForEach("label lattice points", item_count, body);
}

}  // namespace amhex
