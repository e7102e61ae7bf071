// Sorts of millions of elements, stopped within the time of some thousand comparisons.
#pragma once

#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <cstdint>
#include <functional>

#include "base/stop_poll.h"

namespace amhex {

// std::sort. Throws RunStopped when `poll` does; the elements are then in no order, and some may be
// lost.
template <class Iterator, class Less = std::less<>>
void SortPolling(Iterator begin, Iterator end, const StopPoll& poll, const Less& less = {}) {
  int64_t comparisons = 0;
  std::sort(begin, end, [&](const auto& a, const auto& b) {
    poll.At(++comparisons);
    return less(a, b);
  });
}

// The same on the threads of the current oneTBB arena. No two elements may be equal by `less`, or
// how they are ordered depends on the threads.
template <class Iterator, class Less = std::less<>>
void ParallelSortPolling(Iterator begin, Iterator end, const StopPoll& poll,
                         const Less& less = {}) {
  oneapi::tbb::parallel_sort(begin, end, [&](const auto& a, const auto& b) {
    thread_local int64_t comparisons = 0;
    poll.At(++comparisons);
    return less(a, b);
  });
}

}  // namespace amhex
