// The estimate of a relaxation's memory against what it really asks its executor for.
#include <gtest/gtest.h>

#include "exec/cpu_executor.h"
#include "relax/relaxation_impl.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

// Counts what is asked for. Nothing of size is given back before the last of it is asked for, so
// the sum is the peak.
class MeteredExecutor : public CpuExecutor {
 public:
  template <class T>
  HostBuffer<T> Alloc(int64_t count) {
    bytes_ += count * static_cast<int64_t>(sizeof(T));
    return CpuExecutor::Alloc<T>(count);
  }
  int64_t bytes() const { return bytes_; }

 private:
  int64_t bytes_ = 0;
};

TEST(RelaxationBytes, AreWithinATenthOfWhatARunAsksFor) {
  for (const int32_t iteration_count : {0, 3}) {
    for (const int site_count : {200, 5000}) {
      RelaxationTask task = RandomTask(site_count, iteration_count);
      const auto estimate = static_cast<double>(RelaxationBytes<MeteredExecutor>(task));
      MeteredExecutor executor;
      EXPECT_EQ(Relaxation<MeteredExecutor>(executor, task).Run(), RelaxationOutcome::kDone);
      const auto measured = static_cast<double>(executor.bytes());
      EXPECT_NEAR(estimate / measured, 1.0, 0.1) << site_count << " sites, " << iteration_count;
    }
  }
}

// 20 million sites, with room for splits, in half of 80 GB: the lattice may have the other half.
TEST(RelaxationBytes, OfASiteAreFewEnoughForTwentyMillionOnADevice) {
  constexpr int64_t kCapacity = 25'000'000;
  int64_t sum = 0;
  RelaxationArrays<CpuExecutor>().VisitAll(kCapacity, [&](auto& array, int64_t count) {
    sum += count * static_cast<int64_t>(sizeof(*array.View().data));
  });
  EXPECT_LT(sum, 40'000'000'000);
}

}  // namespace
}  // namespace amhex
