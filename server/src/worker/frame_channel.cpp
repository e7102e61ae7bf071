#include "worker/frame_channel.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>

#include "monotonic_clock.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

constexpr size_t kPrefixBytes = 4;

absl::Status Gone() { return absl::UnavailableError("the other process is gone"); }

uint32_t ReadPrefix(const std::string& bytes) {
  uint32_t size = 0;
  for (size_t i = 0; i < kPrefixBytes; ++i) {
    size |= static_cast<uint32_t>(static_cast<uint8_t>(bytes[i])) << (8 * i);
  }
  return size;
}

// The caller comes back after this if it has time left.
constexpr absl::Duration kLongestPoll = absl::Hours(1);

int PollMilliseconds(absl::Duration timeout) {
  if (timeout <= absl::ZeroDuration()) return 0;
  // Rounded up, so that waiting does not degenerate into spinning just before a deadline. Bounded
  // first: an infinite duration leaves no room for rounding.
  return static_cast<int>(absl::ToInt64Milliseconds(std::min(timeout, kLongestPoll))) + 1;
}

}  // namespace

absl::Status FrameChannel::Send(const google::protobuf::MessageLite& message) {
  const std::string body = message.SerializeAsString();
  if (body.size() > kMaxFrameBytes) return absl::InvalidArgumentError("the frame is too large");
  std::string frame;
  for (size_t i = 0; i < kPrefixBytes; ++i) {
    frame.push_back(static_cast<char>(body.size() >> (8 * i)));
  }
  frame += body;
  std::lock_guard<std::mutex> lock(send_mutex_);
  size_t sent = 0;
  while (sent < frame.size()) {
    const ssize_t count =
        send(socket_.get(), frame.data() + sent, frame.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return Gone();
    sent += static_cast<size_t>(count);
  }
  return absl::OkStatus();
}

absl::StatusOr<bool> FrameChannel::TakeFrame(google::protobuf::MessageLite* message) {
  if (buffer_.size() < kPrefixBytes) return false;
  const size_t size = ReadPrefix(buffer_);
  if (size > kMaxFrameBytes) return absl::DataLossError("a frame announces too many bytes");
  if (buffer_.size() < kPrefixBytes + size) return false;
  const bool parsed =
      message->ParseFromArray(buffer_.data() + kPrefixBytes, static_cast<int>(size));
  buffer_.erase(0, kPrefixBytes + size);
  if (!parsed) return absl::DataLossError("a frame holds no message");
  return true;
}

absl::Status FrameChannel::ReadMore() {
  std::array<char, 65536> block;
  const ssize_t count = recv(socket_.get(), block.data(), block.size(), 0);
  if (count < 0 && errno == EINTR) return absl::OkStatus();
  if (count <= 0) return Gone();
  buffer_.append(block.data(), static_cast<size_t>(count));
  return absl::OkStatus();
}

absl::StatusOr<FrameChannel::Outcome> FrameChannel::Receive(google::protobuf::MessageLite* message,
                                                            absl::Duration timeout, int wake_fd) {
  const absl::Time deadline = MonotonicNow() + timeout;
  while (true) {
    AMHEX_ASSIGN_OR_RETURN(const bool whole, TakeFrame(message));
    if (whole) return Outcome::kFrame;
    std::array<pollfd, 2> fds = {pollfd{socket_.get(), POLLIN, 0}, pollfd{wake_fd, POLLIN, 0}};
    const int ready =
        poll(fds.data(), wake_fd >= 0 ? 2 : 1, PollMilliseconds(deadline - MonotonicNow()));
    if (ready < 0 && errno != EINTR) return Gone();
    if (ready == 0) return Outcome::kTimeout;
    if (ready > 0 && fds[0].revents != 0) AMHEX_RETURN_IF_ERROR(ReadMore());
    if (ready > 0 && fds[1].revents != 0 && fds[0].revents == 0) return Outcome::kWoken;
  }
}

}  // namespace amhex::server
