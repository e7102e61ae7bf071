// How many threads loops run on.
#pragma once

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>

namespace amhex {

// Here and now: of the cores that there are, as many as the run may use.
inline int64_t UsedThreads() {
  const auto permitted = static_cast<int64_t>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  return std::min<int64_t>(tbb::this_task_arena::max_concurrency(), permitted);
}

}  // namespace amhex
