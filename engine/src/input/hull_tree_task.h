// The hull's hierarchy over triangles (hull_queries.h) to be built: what crosses the border to the
// CUDA library that is loaded at run time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "base/array_view.h"
#include "base/array_view_of.h"
#include "exec/resident_slot.h"
#include "input/hull_view.h"

namespace amhex {

// The arrays of a HullView on the host.
struct HullArrays {
  std::vector<HullTriangle> triangles;
  std::vector<Vec3d> normals;
  std::vector<int32_t> original;
  std::vector<HullNode> nodes;
  std::vector<HullDipole> dipoles;
  bool is_closed = false;

  HullView View() const {
    return {ArrayViewOf(triangles),
            ArrayViewOf(normals),
            ArrayViewOf(original),
            ArrayViewOf(nodes),
            ArrayViewOf(dipoles),
            {},
            is_closed};
  }
};

// Views are on host arrays that outlive the task. Everything out is as it was unless it was done.
struct HullTreeTask {
  ArrayView<const Vec3d> vertices;
  ArrayView<const std::array<int32_t, 3>> triangles;
  bool edges_balance = false;         // of these triangles (edges_balance.h)
  ResidentSlot* resident = nullptr;   // out: where the copy of the hierarchy stays; empty, not null
  HullArrays* copy = nullptr;         // out, as HullFetchTask's; null: the host wants none
  std::function<bool()> should_stop;  // may be empty
};

// A hierarchy that was built there, for the host: all but triangles and normals, which follow from
// what the host gave.
struct HullFetchTask {
  ResidentSlot* resident = nullptr;
  HullArrays copy;  // out
};

}  // namespace amhex
