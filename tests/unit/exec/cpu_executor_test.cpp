#include "exec/cpu_executor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <vector>

namespace amhex {
namespace {

struct IncrementBody {
  ArrayView<int32_t> values;
  void operator()(int64_t i) const { ++values[i]; }
};

HostBuffer<int32_t> Zeros(CpuExecutor& executor, int64_t count) {
  HostBuffer<int32_t> buffer = executor.Alloc<int32_t>(count);
  const std::vector<int32_t> zeros(static_cast<size_t>(count), 0);
  executor.CopyIn(zeros.data(), count, buffer);
  return buffer;
}

TEST(CpuExecutor, ForEachVisitsEveryElementOnce) {
  CpuExecutor executor;
  for (const int64_t count : {0, 1, 127, 128, 129, 10000}) {
    HostBuffer<int32_t> values = Zeros(executor, count);
    executor.ForEach("increment", count, IncrementBody{values.View()});
    for (int64_t i = 0; i < count; ++i) ASSERT_EQ(values.View()[i], 1) << i << " of " << count;
  }
}

TEST(CpuExecutor, ReduceSumsTheBody) {
  CpuExecutor executor;
  EXPECT_EQ(executor.Reduce("sum", 0, IndexValueBody{}), 0);
  EXPECT_EQ(executor.Reduce("sum", 100000, IndexValueBody{}), int64_t{100000} * 99999 / 2);
}

TEST(CpuExecutor, ExclusiveScanReplacesEveryElementByTheSumBeforeIt) {
  CpuExecutor executor;
  const std::vector<int32_t> input = {3, 0, 5, 2};
  HostBuffer<int32_t> values = executor.Alloc<int32_t>(4);
  executor.CopyIn(input.data(), 4, values);
  executor.ExclusiveScan(values, 4);
  std::vector<int32_t> output(4);
  executor.CopyOut(values, 4, output.data());
  EXPECT_EQ(output, (std::vector<int32_t>{0, 3, 3, 8}));
}

TEST(CpuExecutor, SortByKeyKeepsTheOrderOfEqualKeys) {
  CpuExecutor executor;
  const std::vector<uint32_t> key_input = {2, 1, 2, 0xffffffffu, 1};
  const std::vector<int32_t> id_input = {9, 8, 7, 6, 5};
  KeyedIds<CpuExecutor> pairs, sorted;
  for (KeyedIds<CpuExecutor>* p : {&pairs, &sorted}) {
    p->key = executor.Alloc<uint32_t>(5);
    p->id = executor.Alloc<int32_t>(5);
  }
  executor.CopyIn(key_input.data(), 5, pairs.key);
  executor.CopyIn(id_input.data(), 5, pairs.id);
  executor.SortByKey(pairs, 5, 0xffffffffu, sorted);
  std::vector<int32_t> output(5);
  executor.CopyOut(sorted.id, 5, output.data());
  EXPECT_EQ(output, (std::vector<int32_t>{8, 5, 9, 7, 6}));
}

TEST(CpuExecutor, ForEachOfVisitsAsManyElementsAsTheCountSays) {
  CpuExecutor executor;
  HostBuffer<int32_t> values = Zeros(executor, 10);
  const int64_t actual = 7;
  executor.ForEachOf("increment", 10, {&actual, 1}, IncrementBody{values.View()});
  for (int64_t i = 0; i < 10; ++i) EXPECT_EQ(values.View()[i], i < 7 ? 1 : 0);
}

TEST(CpuExecutor, RepeatShowsTheStateAfterEveryStepInOrder) {
  CpuExecutor executor;
  HostBuffer<int64_t> state = executor.Alloc<int64_t>(1);
  state.View()[0] = 0;
  std::vector<int64_t> seen;
  executor.Repeat(
      5, state, [&] { ++state.View()[0]; }, [&](const int64_t* s) { seen.push_back(*s); });
  EXPECT_EQ(seen, (std::vector<int64_t>{1, 2, 3, 4, 5}));
}

TEST(CpuExecutor, RepeatEndsOnceTheObserverHasSeenEnough) {
  CpuExecutor executor;
  HostBuffer<int64_t> state = executor.Alloc<int64_t>(1);
  state.View()[0] = 0;
  executor.Repeat(
      5, state, [&] { ++state.View()[0]; }, [](const int64_t* s) { return *s == 3; });
  EXPECT_EQ(state.View()[0], 3);
}

TEST(CpuExecutor, SkipsTheRestOnceARunShouldStop) {
  std::atomic<int> polls{0};
  CpuExecutor executor([&] { return ++polls > 3; });
  HostBuffer<int32_t> values = Zeros(executor, 100000);
  executor.ForEach("increment", 100000, IncrementBody{values.View()});
  EXPECT_TRUE(executor.Stopped());
  const int32_t visited =
      std::accumulate(values.View().data, values.View().data + values.size(), 0);
  EXPECT_LT(visited, 100000);
}

}  // namespace
}  // namespace amhex
