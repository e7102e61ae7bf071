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
  // What of the input lies on it, to measure distances against.
  std::vector<Vec3d> input_points;
  // The input's vertices if not all of its triangles are on `mesh`: some may lie far from it.
  std::vector<Vec3d> given_points;
  // The edge length it was rebuilt for, in the user's units; 0 if the user's triangles were kept.
  double user_edge_length = 0;
};

// How fine a surface made by the engine has to be.
struct WantedSize {
  int64_t cell_count = 0;       // 0 = not given
  double user_edge_length = 0;  // 0 = not given; the user's units
  double user_scale = 1;        // the user's units per unit of the surface
};

// `mesh` is in a frame whose box has a diagonal of about 1, centred at the origin.
//
// Nested components keep their meaning: a component that looks inward inside a solid bounds a
// cavity. Openings of manifold surfaces are capped; surfaces that cut themselves, have edges with
// more than two triangles or no two sides are rebuilt where their winding number is one half.
absl::StatusOr<ClosedSurface> CloseMesh(TriangleMesh mesh, const WantedSize& wanted,
                                        RunContext& run);

}  // namespace amhex
