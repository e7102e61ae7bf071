#include "worker/frame_channel.h"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <time.h>

#include <memory>
#include <thread>

#include "absl/time/clock.h"
#include "worker/worker_protocol.pb.h"

namespace amhex::server {
namespace {

using amhex::worker::ToWorker;

class FrameChannelTest : public ::testing::Test {
 protected:
  FrameChannelTest() {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends), 0);
    near_ = std::make_unique<FrameChannel>(UniqueFd(ends[0]));
    far_ = std::make_unique<FrameChannel>(UniqueFd(ends[1]));
  }

  std::unique_ptr<FrameChannel> near_;
  std::unique_ptr<FrameChannel> far_;
};

absl::Duration ProcessorTimeOfThisThread() {
  timespec spent{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &spent);
  return absl::DurationFromTimespec(spent);
}

TEST_F(FrameChannelTest, WaitingForEverSleeps) {
  static constexpr absl::Duration kWait = absl::Seconds(1);
  std::thread sender([this] {
    absl::SleepFor(kWait);
    EXPECT_TRUE(far_->Send(ToWorker()).ok());
  });
  const absl::Duration before = ProcessorTimeOfThisThread();
  ToWorker frame;
  const auto outcome = near_->Receive(&frame, absl::InfiniteDuration());
  EXPECT_LT(ProcessorTimeOfThisThread() - before, kWait / 10);
  sender.join();
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(*outcome, FrameChannel::Outcome::kFrame);
}

TEST_F(FrameChannelTest, NoPatienceReturnsAtOnceAndFiniteOnesEnd) {
  ToWorker frame;
  EXPECT_EQ(*near_->Receive(&frame, absl::ZeroDuration()), FrameChannel::Outcome::kTimeout);
  EXPECT_EQ(*near_->Receive(&frame, absl::Milliseconds(20)), FrameChannel::Outcome::kTimeout);
  ASSERT_TRUE(far_->Send(ToWorker()).ok());
  EXPECT_EQ(*near_->Receive(&frame, absl::ZeroDuration()), FrameChannel::Outcome::kFrame);
}

TEST_F(FrameChannelTest, IsWokenByAnEvent) {
  const UniqueFd event(eventfd(1, EFD_CLOEXEC));
  ToWorker frame;
  const auto outcome = near_->Receive(&frame, absl::InfiniteDuration(), event.get());
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(*outcome, FrameChannel::Outcome::kWoken);
}

TEST_F(FrameChannelTest, OtherSideThatEndsIsUnavailable) {
  far_.reset();
  ToWorker frame;
  EXPECT_TRUE(absl::IsUnavailable(near_->Receive(&frame, absl::InfiniteDuration()).status()));
}

}  // namespace
}  // namespace amhex::server
