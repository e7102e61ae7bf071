// The hull's hierarchy over triangles (hull_queries.h) to be built: what crosses the border to the
// CUDA library that is loaded at run time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "base/array_view.h"
#include "exec/resident_slot.h"
#include "input/hull_view.h"

namespace amhex {

// Views are on host arrays that outlive the task. Everything out is as it was unless it was done.
struct HullTreeTask {
  ArrayView<const Vec3d> vertices;
  ArrayView<const std::array<int32_t, 3>> triangles;
  ResidentSlot* resident = nullptr;  // out: where the copy of the hierarchy stays; empty, not null
  std::vector<HullTriangle> leaf_triangles;  // out: these are the arrays of HullView
  std::vector<Vec3d> normals;
  std::vector<int32_t> original;
  std::vector<HullNode> nodes;
  std::vector<HullDipole> dipoles;
  std::function<bool()> should_stop;  // may be empty
};

}  // namespace amhex
