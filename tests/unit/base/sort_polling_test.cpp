#include "base/sort_polling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "fixtures/damage.h"

namespace amhex {
namespace {

std::vector<int64_t> Shuffled(size_t count) {
  fixtures::Chance chance(1);
  std::vector<int64_t> values(count);
  for (int64_t& value : values) value = static_cast<int64_t>(chance.Below(count));
  return values;
}

TEST(SortPolling, SortsAsTheStandardLibrary) {
  for (const size_t count : {0, 1, 2, 1000, 20000}) {
    std::vector<int64_t> values = Shuffled(count), expected = values;
    std::sort(expected.begin(), expected.end(), std::greater<>());
    std::vector<int64_t> on_threads = values;
    SortPolling(values.begin(), values.end(), StopPoll(), std::greater<>());
    EXPECT_EQ(values, expected);
    ParallelSortPolling(on_threads.begin(), on_threads.end(), StopPoll(), std::greater<>());
    EXPECT_EQ(on_threads, expected);
  }
}

TEST(SortPolling, StopsAmongTheComparisons) {
  RunContext run;
  run.RequestStop();
  std::vector<int64_t> values = Shuffled(20000);
  EXPECT_THROW(SortPolling(values.begin(), values.end(), StopPoll(run)), RunStopped);
  values = Shuffled(20000);
  EXPECT_THROW(ParallelSortPolling(values.begin(), values.end(), StopPoll(run)), RunStopped);
}

}  // namespace
}  // namespace amhex
