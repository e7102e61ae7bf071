// A client whose process is suspended (Ctrl-Z in a shell, a virtual machine that is paused) has
// missed nothing that does not wait for it.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "rpc/patience.h"
#include "rpc/silence_guard.h"

namespace amhex::client {
namespace {

constexpr absl::Duration kLongestSilence = absl::Milliseconds(400);
constexpr auto kSuspension = std::chrono::milliseconds(1200);

// Stops this process and has it go on later.
void StandStill() {
  const pid_t self = getpid();
  const pid_t waker = fork();
  if (waker == 0) {
    std::this_thread::sleep_for(kSuspension);
    kill(self, SIGCONT);
    _exit(0);
  }
  raise(SIGSTOP);
}

bool IsCutOff(const SilenceGuard& guard) {
  return absl::IsUnavailable(guard.Verdict(absl::CancelledError("")));
}

TEST(ASuspendedClient, HasNotWaitedInVainForTheServer) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto suspended = [] {
    grpc::ClientContext context;
    SilenceGuard guard(&context, kLongestSilence);
    const auto start = std::chrono::steady_clock::now();
    StandStill();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const bool stood_still = std::chrono::steady_clock::now() - start >= kSuspension;
    _exit(stood_still && !IsCutOff(guard) ? 0 : 1);
  };
  EXPECT_EXIT(suspended(), testing::ExitedWithCode(0), "");
}

TEST(ASuspendedClient, StillNoticesAServerThatSaysNothingAfterwards) {
  grpc::ClientContext context;
  SilenceGuard guard(&context, kLongestSilence);
  while (!IsCutOff(guard)) std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

TEST(ASuspendedClient, TriesAgainAfterTheFirstFailureHoweverLongAgoTheLastSuccessWas) {
  Patience patience(absl::Milliseconds(300), nullptr);
  patience.Renew();
  absl::SleepFor(absl::Milliseconds(600));
  EXPECT_TRUE(patience.ShouldRetry(absl::UnavailableError("cut off")));
  int retries = 1;
  while (patience.ShouldRetry(absl::UnavailableError("cut off"))) ++retries;
  EXPECT_LT(retries, 4);
}

}  // namespace
}  // namespace amhex::client
