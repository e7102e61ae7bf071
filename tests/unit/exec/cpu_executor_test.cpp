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
  EXPECT_EQ(executor.ExclusiveScan(values, 4), 10);
  std::vector<int32_t> output(4);
  executor.CopyOut(values, 4, output.data());
  EXPECT_EQ(output, (std::vector<int32_t>{0, 3, 3, 8}));
}

TEST(CpuExecutor, SortByKeyBreaksTiesByValue) {
  CpuExecutor executor;
  const std::vector<uint32_t> key_input = {2, 1, 2, 0xffffffffu, 1};
  const std::vector<int32_t> value_input = {9, 8, 7, 6, 5};
  HostBuffer<uint32_t> keys = executor.Alloc<uint32_t>(5);
  HostBuffer<int32_t> values = executor.Alloc<int32_t>(5);
  executor.CopyIn(key_input.data(), 5, keys);
  executor.CopyIn(value_input.data(), 5, values);
  executor.SortByKey(keys, values, 5);
  std::vector<int32_t> output(5);
  executor.CopyOut(values, 5, output.data());
  EXPECT_EQ(output, (std::vector<int32_t>{5, 8, 7, 9, 6}));
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
