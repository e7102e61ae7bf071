// From any triangle soup to a closed, outward oriented surface, keeping the user's triangles where
// they already bound a solid.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/run_context.h"

namespace amhex {

// A surface that bounds a solid: every edge has two triangles that agree on the outside.
struct ClosedSurface {
  TriangleMesh mesh;
  std::vector<std::string> warnings;  // one per thing repaired, for the user
};

// Says how fine a surface made by the engine has to be; the volume is what it would enclose.
struct WantedSize {
  int64_t cell_count = 0;  // 0 = not given
  double edge_length = 0;  // 0 = not given; units of the surface
};

// `mesh` is in a frame whose box has a diagonal of about 1, centred at the origin.
//
// Nested components keep their meaning: a component that looks inward inside a solid bounds a
// cavity. Openings of manifold surfaces are capped; surfaces that cut themselves, have edges with
// more than two triangles or no two sides are rebuilt where their winding number is one half.
absl::StatusOr<ClosedSurface> CloseMesh(TriangleMesh mesh, const WantedSize& wanted,
                                        RunContext& run);

}  // namespace amhex
