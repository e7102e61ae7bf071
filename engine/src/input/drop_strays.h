// Points of a scan that lie far from the body and make its box many times too large.
#pragma once

#include <optional>

#include "amhex/input_hull.h"
#include "base/stop_poll.h"

namespace amhex {

// The cloud without its stray points, or nothing where it has none. Strays are few, in small groups
// with empty space around them, and the box of all other points is at most half as large without
// them, which is repeated until it is not; strays nearer to the body are told by their neighbours
// (PrepareCloud). Points keep their order. O(n log n) each
// time, O(n) where they would be none.
std::optional<PointCloud> DropStrays(const PointCloud& cloud, const StopPoll& poll = {});

}  // namespace amhex
