// Clouds whose noise is larger than the distance of their points, evened out before use.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"

namespace amhex {

// Moves every point to the plane through its neighbours, as many as it takes for them to lie along
// a plane rather than fill space; returns how many that are. Where points are too uneven for one
// number, they are those within a radius, and returned is their median. A cloud whose sixteen
// nearest neighbours already do is left as it is, and so is one that no number of neighbours makes
// flat or whose points lie in layers: 0. `normals`: unit, or zero where there is none, one for each
// point; neighbours that look the other way do not count. O(n log n).
absl::StatusOr<int> SmoothNoise(const std::vector<Vec3d>& normals, RunContext& run,
                                std::vector<Vec3d>& points);

}  // namespace amhex
