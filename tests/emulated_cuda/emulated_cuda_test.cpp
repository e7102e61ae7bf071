// What the CUDA library does with a device: memory, failures, streams, graphs. On the emulated one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "amhex/mesher.h"
#include "cuda/cuda_library.h"
#include "emulated_cuda/emulated_cuda_fixture.h"
#include "exec/cpu_executor.h"
#include "relax/relaxation_cpu.h"
#include "relax/relaxation_impl.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

RelaxationTask SmallTask(int32_t iterations) { return RandomTask(150, iterations, 1.5); }

absl::StatusOr<bool> RelaxOnCuda(RelaxationTask& task) { return RunOnCuda(&task); }

class EmulatedCuda : public EmulatedDeviceTest {
 protected:
  // Runs once more and compares with the CPU: the device is as good as before.
  void ExpectUsable() {
    device_->Restart();
    RelaxationTask cuda = SmallTask(2), cpu = SmallTask(2);
    ASSERT_TRUE(RelaxOnCuda(cuda).ok());
    RelaxOnCpu(cpu);
    EXPECT_EQ(cuda.position, cpu.position);
    EXPECT_EQ(controls().used, 0);
    EXPECT_EQ(controls().stray_frees, 0);
  }
};

TEST_F(EmulatedCuda, ReplaysMostIterationsAndWaitsForNone) {
  std::vector<int64_t> waits;
  for (const int32_t iterations : {6, 13}) {
    device_->Restart();
    RelaxationTask cuda = SmallTask(iterations), cpu = SmallTask(iterations);
    cuda.propagates_orientation = cpu.propagates_orientation = false;
    std::vector<int32_t> reported;
    cuda.on_iteration = [&](int32_t iteration, double, int64_t) { reported.push_back(iteration); };
    ASSERT_TRUE(RelaxOnCuda(cuda).ok());
    RelaxOnCpu(cpu);
    EXPECT_EQ(cuda.position, cpu.position);
    EXPECT_EQ(cuda.point_count, cpu.point_count);
    ASSERT_EQ(reported.size(), static_cast<size_t>(iterations));
    for (int32_t i = 0; i < iterations; ++i) EXPECT_EQ(reported[static_cast<size_t>(i)], i + 1);
    EXPECT_EQ(controls().replays, (iterations - 2) / 2);
    waits.push_back(controls().waits);
  }
  EXPECT_EQ(waits[0], waits[1]);
}

TEST_F(EmulatedCuda, TakesAsMuchMemoryAsEstimated) {
  for (const int32_t iterations : {0, 3}) {
    for (const int sites : {1000, 5000}) {
      device_->Restart();
      RelaxationTask refused = RandomTask(sites, iterations);
      controls().capacity = 1;
      const double estimate = Announced(RelaxOnCuda(refused).status());
      device_->Restart();
      RelaxationTask task = RandomTask(sites, iterations);
      ASSERT_TRUE(RelaxOnCuda(task).ok());
      EXPECT_NEAR(estimate / static_cast<double>(controls().peak), 1.0, 0.1)
          << sites << " sites, " << iterations << " iterations";
      EXPECT_EQ(controls().used, 0);
    }
  }
}

TEST_F(EmulatedCuda, RefusesWhatDoesNotFitBeforeTakingAnyMemory) {
  RelaxationTask task = SmallTask(2);
  controls().capacity = RelaxationBytes<CpuExecutor>(task) * 9 / 10;
  const auto outcome = RelaxOnCuda(task);
  EXPECT_EQ(outcome.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(outcome.status().message()),
              HasSubstr(" of " + std::to_string(controls().capacity)));
  EXPECT_EQ(controls().peak, 0);
  ExpectUsable();
}

// Somebody else takes the memory after the check: any allocation may be the one that fails.
TEST_F(EmulatedCuda, MemoryThatEndsOnTheWayIsToldWithNumbersAndGivenBack) {
  RelaxationTask whole = SmallTask(2);
  ASSERT_TRUE(RelaxOnCuda(whole).ok());
  const int64_t calls = controls().calls;
  int exhausted = 0;
  for (int64_t call = 0; call < calls; call += 7) {
    device_->Restart();
    controls().failing_call = call;
    controls().failure = emulated::kOutOfMemory;
    RelaxationTask task = SmallTask(2);
    const auto outcome = RelaxOnCuda(task);
    EXPECT_EQ(controls().used, 0) << "call " << call;
    // A call in a destructor fails unnoticed.
    if (outcome.ok()) continue;
    EXPECT_EQ(outcome.status().code(), absl::StatusCode::kResourceExhausted) << "call " << call;
    EXPECT_THAT(std::string(outcome.status().message()), HasSubstr("out of memory"));
    ++exhausted;
  }
  EXPECT_GT(exhausted, calls / 7 / 2);
  EXPECT_FALSE(IsDeviceLost());
  ExpectUsable();
}

TEST_F(EmulatedCuda, AnyFailureEndsTheRunAndLeavesTheDeviceUsable) {
  RelaxationTask whole = SmallTask(5);
  ASSERT_TRUE(RelaxOnCuda(whole).ok());
  const int64_t calls = controls().calls;
  int failed = 0;
  for (int64_t call = 3; call < calls; call += 11) {
    device_->Restart();
    controls().failing_call = call;
    RelaxationTask task = SmallTask(5);
    const auto outcome = RelaxOnCuda(task);
    EXPECT_EQ(controls().used, 0) << "call " << call;
    if (outcome.ok()) continue;
    EXPECT_EQ(outcome.status().code(), absl::StatusCode::kInternal) << "call " << call;
    ++failed;
  }
  EXPECT_GT(failed, calls / 11 / 2);
  EXPECT_FALSE(IsDeviceLost());
  ExpectUsable();
}

TEST_F(EmulatedCuda, StopsWhereverItIsAskedTo) {
  for (int polls = 0; polls < 400; polls += 13) {
    device_->Restart();
    RelaxationTask task = SmallTask(6);
    int left = polls;
    task.should_stop = [&] { return left-- <= 0; };
    const auto outcome = RelaxOnCuda(task);
    ASSERT_TRUE(outcome.ok()) << outcome.status();
    EXPECT_EQ(*outcome, left >= 0) << polls;
    EXPECT_EQ(controls().used, 0) << polls;
  }
  ExpectUsable();
}

TEST_F(EmulatedCuda, RunsSeveralJobsAtOnce) {
  RelaxationTask expected = SmallTask(4);
  RelaxOnCpu(expected);
  std::vector<RelaxationTask> tasks(3, SmallTask(4));
  std::vector<std::thread> threads;
  for (RelaxationTask& task : tasks) {
    threads.emplace_back([&task] { EXPECT_TRUE(RelaxOnCuda(task).ok()); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const RelaxationTask& task : tasks) EXPECT_EQ(task.position, expected.position);
  EXPECT_EQ(controls().used, 0);
}

absl::StatusOr<MeshingResult> MeshCube(Backend backend) {
  MeshingParams params;
  params.sizing.cell_count = 27;
  params.run.backend = backend;
  // With iterations, so that the device has something to move.
  params.relaxation.iteration_count = 2;
  RunContext run;
  return Mesh(fixtures::MakeBox({1, 1, 1}, 0.5), params, run);
}

TEST_F(EmulatedCuda, AutoTakesTheDeviceWhereItHasRoom) {
  const auto result = MeshCube(Backend::kAuto);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_GT(controls().launches, 0);
  EXPECT_EQ(result->effective_params.run.backend, Backend::kCuda);
  EXPECT_THAT(result->backend_note, Not(HasSubstr("cpu")));
}

TEST_F(EmulatedCuda, AutoTakesTheCpuWhereTheDeviceIsTooSmallAndSaysSo) {
  const auto expected = MeshCube(Backend::kCpu);
  ASSERT_TRUE(expected.ok()) << expected.status();
  controls().capacity = 1;
  const auto result = MeshCube(Backend::kAuto);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(controls().launches, 0);
  EXPECT_EQ(result->mesh.vertices, expected->mesh.vertices);
  EXPECT_EQ(result->effective_params.run.backend, Backend::kCpu);
  EXPECT_THAT(result->backend_note, HasSubstr("on the cpu instead: smoothing"));
  EXPECT_THAT(result->backend_note, HasSubstr("on the cpu instead: relaxing"));
  EXPECT_THAT(result->backend_note, HasSubstr("on the cpu instead: placing"));
  EXPECT_THAT(result->backend_note, HasSubstr(" of 1 are free"));
}

TEST_F(EmulatedCuda, WhoeverAsksForADeviceThatIsTooSmallIsRefused) {
  controls().capacity = 1;
  EXPECT_EQ(MeshCube(Backend::kCuda).status().code(), absl::StatusCode::kResourceExhausted);
}

// The memory may be gone at any moment; what the device has done by then is not taken over.
TEST_F(EmulatedCuda, AutoTakesTheCpuWhereMemoryEndsOnTheWay) {
  const auto expected = MeshCube(Backend::kCpu);
  ASSERT_TRUE(MeshCube(Backend::kAuto).ok());
  const int64_t calls = controls().calls;
  int taken_over = 0;
  for (int64_t call = 0; call < calls; call += calls / 4) {
    device_->Restart();
    controls().failing_call = call;
    controls().failure = emulated::kOutOfMemory;
    const auto result = MeshCube(Backend::kAuto);
    ASSERT_TRUE(result.ok()) << result.status() << " call " << call;
    EXPECT_EQ(result->mesh.vertices, expected->mesh.vertices) << "call " << call;
    EXPECT_EQ(controls().used, 0) << "call " << call;
    if (result->effective_params.run.backend == Backend::kCpu) ++taken_over;
  }
  EXPECT_GT(taken_over, 0);
}

// Before anything is known of the run but its size; a cube, so that its size is exact.
TEST_F(EmulatedCuda, TakesAboutAsMuchMemoryAsAJobOfItsSizeIsSaidTo) {
  MeshingParams params;
  params.sizing.cell_count = 512;
  params.sizing.trial_count = 1;  // in so small a box a little more is a whole layer of nodes
  params.run.backend = Backend::kCuda;
  const InputHull cube = fixtures::MakeBox({1, 1, 1}, 0.25);
  const auto peak_of = [&] {
    device_->Restart();
    RunContext run;
    const auto result = Mesh(cube, params, run);
    EXPECT_TRUE(result.ok()) << result.status();
    return static_cast<double>(controls().peak);
  };
  const auto expected = [&] {
    const auto estimate = EstimateCost(cube, params);
    EXPECT_TRUE(estimate.ok()) << estimate.status();
    return estimate.ok() ? static_cast<double>(estimate->device_memory_bytes) : 0.0;
  };
  EXPECT_NEAR(expected() / peak_of(), 1.0, 0.1);
  params.relaxation.initialization = Initialization::kGrid;
  params.relaxation.iteration_count = 1;
  // The solid fills its box, where half is expected.
  EXPECT_NEAR(expected() / peak_of(), 1.0, 0.3);
}

TEST_F(EmulatedCuda, JobsThatCannotFitAreRefusedBeforeTheyBegin) {
  MeshingParams params;
  params.sizing.cell_count = 10'000'000;
  params.run.backend = Backend::kCuda;
  const InputHull cube = fixtures::MakeBox({1, 1, 1}, 0.5);
  const auto refused = EstimateCost(cube, params);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.status().message()),
              HasSubstr("the CUDA device has " + std::to_string(CudaMemoryBytes())));
  params.run.backend = Backend::kAuto;
  EXPECT_TRUE(EstimateCost(cube, params).ok());
}

// Last, since the process remembers.
TEST_F(EmulatedCuda, ZAFailureThatLastsMeansTheDeviceIsLost) {
  controls().failing_call = 40;
  controls().failure = emulated::kIllegalAddress;
  controls().is_sticky = true;
  RelaxationTask task = SmallTask(2);
  const auto outcome = RelaxOnCuda(task);
  EXPECT_EQ(outcome.status().code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(outcome.status().message()), HasSubstr("illegal memory access"));
  EXPECT_TRUE(IsDeviceLost());
}

}  // namespace
}  // namespace amhex
