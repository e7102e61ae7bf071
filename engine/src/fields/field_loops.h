// Parallel loops of the field stages: cancellable, and the same result at any thread count.
#pragma once

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "amhex/run_context.h"
#include "fields/sum_blocks.h"

namespace amhex::fields {

// Elements between two polls of ShouldStop: microseconds each, so far below the 100 ms rule.
inline constexpr int64_t kLoopGrain = 512;

// Calls body(i) once for every i in [0, count). Bodies may only write what belongs to their own i.
// After a stop request the rest is skipped: callers must ask run.CheckStop() before using results.
template <class Body>
void ForEach(const RunContext& run, int64_t count, const Body& body) {
  using Range = oneapi::tbb::blocked_range<int64_t>;
  oneapi::tbb::parallel_for(Range(0, count, kLoopGrain), [&](const Range& range) {
    // Ranges may be far longer than the grain.
    for (int64_t first = range.begin(); first < range.end(); first += kLoopGrain) {
      if (run.ShouldStop()) return;
      const int64_t end = std::min(range.end(), first + kLoopGrain);
      for (int64_t i = first; i < end; ++i) body(i);
    }
  });
}

// Sum of range_sum(begin, end) over fixed blocks, combined in order: independent of threads.
template <class RangeSum>
double DeterministicSum(const RunContext& run, int64_t count, const RangeSum& range_sum) {
  const int64_t block_count = SumBlocks(count);
  std::vector<double> partial(block_count, 0.0);
  using Range = oneapi::tbb::blocked_range<int64_t>;
  oneapi::tbb::parallel_for(Range(0, block_count, 1), [&](const Range& range) {
    for (int64_t b = range.begin(); b < range.end(); ++b) {
      if (run.ShouldStop()) return;
      partial[b] = range_sum(b * kSumBlock, std::min(count, (b + 1) * kSumBlock));
    }
  });
  double sum = 0;
  for (const double p : partial) sum += p;
  return sum;
}

// The part [begin, end] of the stage's progress that one step covers.
class ProgressSlice {
 public:
  ProgressSlice(RunContext& run, double begin, double end) : run_(run), begin_(begin), end_(end) {}

  // fraction in [0, 1] of the step.
  void Report(double fraction) const {
    Progress progress = run_.progress();
    progress.stage_fraction = begin_ + (end_ - begin_) * std::clamp(fraction, 0.0, 1.0);
    run_.Report(progress);
  }
  RunContext& run() const { return run_; }
  // The part of this slice from `begin` to `end`, shares of it.
  ProgressSlice Part(double begin, double end) const {
    return {run_, begin_ + (end_ - begin_) * begin, begin_ + (end_ - begin_) * end};
  }

 private:
  RunContext& run_;
  double begin_, end_;
};

}  // namespace amhex::fields
