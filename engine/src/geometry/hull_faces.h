// Which open cube faces lie on the hull. Paper: section 5.1 ("labelled as part of the outer hull").
#pragma once

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "geometry/cubes.h"
#include "geometry/merged_cubes.h"
#include "input/hull.h"

namespace amhex {

// Sets `hull_faces` and `on_hull` from `matches`, and projects the vertices on the hull to it.
// Strict on purpose: an interior face pulled to the hull costs more cells than a hull face that
// is found later. Fails only with the run's status.
absl::Status LabelHullFaces(const Cubes& cubes, const Hull& hull, const RunContext& run,
                            MergedCubes* merged);

}  // namespace amhex
