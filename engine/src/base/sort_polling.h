// std::sort for millions of elements, stopped within the time of some thousand comparisons.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>

#include "base/stop_poll.h"

namespace amhex {

// Throws RunStopped when `poll` does; the elements are then in no order, and some may be lost.
template <class Iterator, class Less = std::less<>>
void SortPolling(Iterator begin, Iterator end, const StopPoll& poll, const Less& less = {}) {
  int64_t comparisons = 0;
  std::sort(begin, end, [&](const auto& a, const auto& b) {
    poll.At(++comparisons);
    return less(a, b);
  });
}

}  // namespace amhex
