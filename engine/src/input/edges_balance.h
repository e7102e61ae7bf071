// Whether a surface has no boundary.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/stop_poll.h"

namespace amhex {

// Whether every edge is used as often one way as the other, so that the surface winds a whole
// number of times around every point off it, wherever its triangles lie. By sums of 64 random bits
// per edge, which are wrong once in 2^64 surfaces. Linear; throws RunStopped when `poll` does.
bool EdgesBalance(const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll = {});

}  // namespace amhex
