// The real worker on a device: the emulated one (tests/emulated_cuda), as it should be and broken.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "emulated_cuda/emulated_device.h"
#include "service_fixtures.h"
#include "worker/worker_fd.h"
#include "worker_probe.h"
#include "worker_process.h"

namespace amhex::server {
namespace {

constexpr absl::Duration kPatience = absl::Seconds(100);

class WorkerOnADevice : public ::testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the thread sanitizer does not follow fibers";
#endif
    setenv("AMHEX_CUDA_LIBRARY", AMHEX_EMULATED_LIBRARY, 1);
  }
  void TearDown() override {
    unsetenv("AMHEX_CUDA_LIBRARY");
    unsetenv(emulated::kLastingFailureVariable);
  }

  void Start() {
    auto started = WorkerProcess::Start({AMHEX_REAL_WORKER, 0}, kPatience);
    ASSERT_TRUE(started.ok()) << started.status();
    worker_ = *std::move(started);
  }

  absl::Status Try() {
    return ProbeWorker(&worker_->channel(),
                       {folder_ / "input", folder_ / "result", kPatience, [] { return false; }});
  }

  TemporaryFolder folder_;
  std::unique_ptr<WorkerProcess> worker_;
};

TEST_F(WorkerOnADevice, TellsOfItAndMeshes) {
  ASSERT_NO_FATAL_FAILURE(Start());
  bool is_told = false;
  for (const auto& backend : worker_->hello().backends()) {
    if (backend.backend() == amhex::v1::BACKEND_CUDA) is_told = backend.available();
  }
  EXPECT_TRUE(is_told);
  const absl::Status verdict = Try();
  EXPECT_TRUE(verdict.ok()) << verdict;
}

TEST_F(WorkerOnADevice, EndsWithACodeOfItsOwnOnceTheDeviceIsLost) {
  setenv(emulated::kLastingFailureVariable, "5", 1);
  ASSERT_NO_FATAL_FAILURE(Start());
  EXPECT_FALSE(Try().ok());
  const WorkerExit exit = worker_->Wait();
  EXPECT_EQ(exit.signal, 0);
  EXPECT_EQ(exit.exit_code, kDeviceLostExitCode);
}

}  // namespace
}  // namespace amhex::server
