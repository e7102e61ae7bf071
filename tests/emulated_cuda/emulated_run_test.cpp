// What a whole run takes of a device besides time. docs/performance.md tells what the counts are.
#include <gtest/gtest.h>

#include <cstdint>
#include <iostream>

#include "amhex/mesher.h"
#include "emulated_cuda/emulated_cuda_fixture.h"
#include "fixtures/solids.h"

namespace amhex {
namespace {

class EmulatedRun : public EmulatedDeviceTest {
 protected:
  absl::StatusOr<MeshingResult> MeshBracket(int32_t trials) {
    MeshingParams params;
    params.sizing.cell_count = 382;
    params.sizing.trial_count = trials;
    params.run.backend = Backend::kCuda;
    RunContext run;
    run.on_stage_done = [this](const StageReport& report) { Tell(StageName(report.stage)); };
    return Mesh(fixtures::MakeBracket(1, 0.125), params, run);
  }
  // All so far.
  void Tell(const char* stage) {
    const emulated::Controls& c = controls();
    std::cout << stage << ": " << c.uploads << " uploads of " << c.uploaded_bytes << " bytes, "
              << c.downloads << " downloads of " << c.downloaded_bytes << " bytes, " << c.waits
              << " waits, " << c.looks << " looks, " << c.launches << " kernels, " << c.replays
              << " graphs, " << c.made << " streams, pools and pinned pieces, " << c.peak
              << " bytes at most, " << c.calls << " calls\n";
  }
};

// Upper bounds, somewhat above what is counted: whoever makes a run copy more or wait more often
// finds out here.
TEST_F(EmulatedRun, CopiesAndWaitsNoMoreThanItDid) {
  ASSERT_TRUE(MeshBracket(1).ok());
  EXPECT_LE(controls().uploaded_bytes, 4'500'000);
  EXPECT_LE(controls().downloaded_bytes, 1'450'000);
  EXPECT_LE(controls().uploads, 44);
  EXPECT_LE(controls().downloads, 39);
  EXPECT_LE(controls().waits, 10);
  EXPECT_LE(controls().looks, 650);
}

// What takes long to make is made once for all tasks.
TEST_F(EmulatedRun, MakesItsStreamsAndItsPinnedMemoryOnce) {
  ASSERT_TRUE(MeshBracket(1).ok());
  const int64_t made = controls().made;
  device_->Restart();
  ASSERT_TRUE(MeshBracket(3).ok());
  EXPECT_EQ(controls().made, made);
  EXPECT_EQ(controls().used, 0);
  EXPECT_EQ(controls().unused, 0);
}

// Memory that is kept for the next task is no hindrance where there is just enough for one.
TEST_F(EmulatedRun, TakesNoMoreMemoryThanItUses) {
  const auto expected = MeshBracket(1);
  ASSERT_TRUE(expected.ok());
  const int64_t peak = controls().peak;
  device_->Restart();
  controls().capacity = peak + peak / 20;
  const auto result = MeshBracket(1);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->mesh.vertices, expected->mesh.vertices);
}

// A lane that was left in any state is not used again.
TEST_F(EmulatedRun, AFailureAnywhereGivesAllBackAndTheNextRunIsAsGoodAsAnyOther) {
  const auto mesh = [] {
    MeshingParams params;
    params.sizing.cell_count = 64;
    params.sizing.trial_count = 1;
    params.run.backend = Backend::kCuda;
    RunContext run;
    return Mesh(fixtures::MakeSphere(1, 0.08), params, run);
  };
  // Emulating its many sweeps would take minutes; failures of sweeps are tested by themselves.
  visits_worth_device = kVisitsWorthDevice;
  const auto expected = mesh();
  ASSERT_TRUE(expected.ok()) << expected.status();
  const int64_t calls = controls().calls;
  constexpr int kFailures = 7;
  for (int i = 0; i < kFailures; ++i) {
    device_->Restart();
    controls().failing_call = 3 + i * calls * 9 / 10 / kFailures;
    EXPECT_EQ(mesh().status().code(), absl::StatusCode::kInternal) << i;
    EXPECT_EQ(controls().used, 0) << i;
    EXPECT_EQ(controls().unused, 0) << i;
    EXPECT_EQ(controls().stray_frees, 0) << i;
  }
  device_->Restart();
  const auto again = mesh();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->mesh.vertices, expected->mesh.vertices);
  visits_worth_device = 0;
}

}  // namespace
}  // namespace amhex
