// Which open cube faces lie on the hull. Paper: section 5.1 ("labelled as part of the outer hull").
#pragma once

#include "absl/status/status.h"
#include "geometry/cubes.h"
#include "geometry/merged_cubes.h"

namespace amhex {

class HullAsker;  // input/ask_hull.h

// Sets `hull_faces` and `on_hull` from `matches`, and projects the vertices on the hull to it.
// Strict on purpose: an interior face pulled to the hull costs more cells than a hull face that
// is found later. Errors: those of the asker.
absl::Status LabelHullFaces(const Cubes& cubes, const HullAsker& hull, MergedCubes* merged);

}  // namespace amhex
