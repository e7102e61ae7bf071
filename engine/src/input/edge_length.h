// Which edge length a job means, from its parameters and the solid.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/params.h"
#include "input/hull_queries.h"

namespace amhex {

inline constexpr int64_t kMaxCellCount = 20'000'000;
// Without any wish the solid gets about this many cells ...
inline constexpr int64_t kDefaultCellCount = 5'000;
// ... or more, until its minimum width holds two cells, but no more than this many.
inline constexpr int64_t kMaxDefaultCellCount = 20'000;

// The edge length h, in units of `solid`, whose frame is `user_scale` times smaller than the
// user's.
//   sizing.edge_length given: that length;
//   sizing.cell_count given:  (volume / cell_count)^(1/3), or what makes so many cells where walls
//            hold one layer of them (input/single_layers.h);
//   neither: (volume / 5000)^(1/3), but at most half of the minimum width, but at least
//            (volume / 20000)^(1/3). The minimum width is the 10th percentile, by area, of the
//            thickness measured straight inward from the surface.
//
// Only the last, and the second on thin solids, ask `solid` anything and need a hierarchy, built on
// `device` unless that is null; throws as that does. OUT_OF_RANGE if that makes more than 20
// million cells, INVALID_ARGUMENT if it makes less than one.
absl::StatusOr<double> ResolveEdgeLength(const SizingParams& sizing, const TriangleMesh& solid,
                                         double volume, double user_scale, const StopPoll& poll,
                                         DeviceUse* device);

}  // namespace amhex
