// The faces of an edge network as plain arrays: what crosses the border to the CUDA library that is
// loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/array_view.h"
#include "topology/edge_network_view.h"
#include "topology/primitives.h"

namespace amhex {

// Views do not own.
struct EdgesToSearch {
  ArrayView<const VertexPair> edges;  // in any order and direction, repeated or not
  ArrayView<const Vec3d> vertices;

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(edges), visit(vertices);
  }
};

// Views are on host arrays that outlive the task.
struct CollectFacesTask {
  EdgesToSearch given;
  std::vector<CellFace> faces;        // out: CollectFaces' answer; as it was unless it was done
  std::function<bool()> should_stop;  // may be empty
};

}  // namespace amhex
