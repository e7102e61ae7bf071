// Runs the labelling of all tiles on an executor.
#pragma once

#include <cstdint>

#include "relax/label_body.h"
#include "relax/relaxation_task.h"

namespace amhex {

// One element per tile and side; the CUDA executor has one of its own (label_tiles.cuh).
template <class E>
class TileLabeller {
 public:
  TileLabeller(E& executor, const RelaxationTask& /*task*/) : executor_(executor) {}

  void Label(const LabelTileBody& body) {
    executor_.ForEach("label lattice points", body.items.size, body);
  }

 private:
  E& executor_;
};

}  // namespace amhex
