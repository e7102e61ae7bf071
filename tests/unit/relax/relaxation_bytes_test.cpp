// The estimate of a relaxation's memory against what it really asks its executor for.
#include <gtest/gtest.h>

#include <vector>

#include "exec/cpu_executor.h"
#include "fixtures/solids.h"
#include "relax/build_barrier.h"
#include "relax/relaxation_impl.h"
#include "unit/graph/random_points.h"
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

RelaxationTask TaskWith(int site_count, int32_t iteration_count) {
  RunContext run;
  RelaxationTask task;
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeSphere(5, 0.5));
  task.barrier = *BuildHullBarrier(hull, 32, 1.0, run);
  const BarrierView barrier = task.barrier.View();
  for (const Vec3f& unit : RandomPoints(3, site_count, 1)) {
    const Vec3d e = task.barrier.extent;
    const Vec3d p = {unit.x * e.x, unit.y * e.y, unit.z * e.z};
    if (!barrier.IsInside(p)) continue;
    task.position.push_back(p);
    task.orientation.push_back({});
    task.size.push_back({1, 1, 1});
    task.is_inside.push_back(1);
  }
  const HullSamples samples = SamplesOf(hull);
  for (size_t i = 0; i < samples.position.size(); ++i) {
    task.sample_position.push_back(ToFloat(samples.position[i] - task.barrier.origin));
    task.sample_normal.push_back(ToFloat(samples.normal[i]));
    task.sample_orientation.push_back({});
  }
  task.items = ListLabelItems(task.barrier, {});
  task.iteration_count = iteration_count;
  task.propagates_orientation = iteration_count > 0;
  return task;
}

TEST(RelaxationBytes, AreWithinATenthOfWhatARunAsksFor) {
  for (const int32_t iteration_count : {0, 3}) {
    for (const int site_count : {200, 5000}) {
      RelaxationTask task = TaskWith(site_count, iteration_count);
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
