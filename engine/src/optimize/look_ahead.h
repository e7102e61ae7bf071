// Steps that are taken one after the other, but found side by side before.
#pragma once

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "amhex/run_context.h"

namespace amhex {

enum class Taken : uint8_t {
  kHeld,   // what had been found still was so
  kAnew,   // it had to be found again
  kEnough  // and no other step is wanted
};

// Steps that are looked at side by side. Of more of them more have to be found again, because one
// before has moved what they saw: 0.06 for each one before on a bunny of 3,500 cells, 0.007 on an
// igea of 5,200 that is noisy all over.
inline constexpr size_t kFewestAhead = 4;
inline constexpr size_t kMostAhead = 64;
// Shares of a batch found again from which on the next one is smaller, and up to which larger.
inline constexpr double kOftenAgain = 0.15;
inline constexpr double kSeldomAgain = 0.05;

// On one thread nothing is gained by looking ahead.
inline bool HasSeveralThreads() {
  using oneapi::tbb::global_control;
  return global_control::active_value(global_control::max_allowed_parallelism) > 1;
}

// Steps 0 … count - 1. look(i) finds a step's Found and changes nothing that others see;
// take(i, found) makes the step, in turn, and tells by Taken what that was. `found` is empty where
// nobody has looked. What take makes must be the same whether or not it is. Ends early when the run
// is to stop.
template <class Found, class Look, class Take>
void TakeLookingAhead(size_t count, const RunContext& run, const Look& look, const Take& take) {
  const bool looks_ahead = HasSeveralThreads();
  size_t size = kFewestAhead;
  for (size_t begin = 0, end = 0; begin < count; begin = end) {
    end = std::min(begin + size, count);
    std::vector<std::optional<Found>> found(end - begin);
    if (looks_ahead && end - begin > 1) {
      oneapi::tbb::parallel_for(begin, end, [&](size_t i) {
        if (!run.ShouldStop()) found[i - begin].emplace(look(i));
      });
    }
    size_t again = 0;
    for (size_t i = begin; i < end; ++i) {
      if (run.ShouldStop()) return;
      const Taken taken = take(i, std::move(found[i - begin]));
      if (taken == Taken::kEnough) return;
      again += taken == Taken::kAnew ? 1 : 0;
    }
    const double share = static_cast<double>(again) / static_cast<double>(end - begin);
    if (share > kOftenAgain) {
      size = std::max(size / 2, kFewestAhead);
    } else if (share <= kSeldomAgain) {
      size = std::min(2 * size, kMostAhead);
    }
  }
}

}  // namespace amhex
