// Length-prefixed protobuf messages over a stream socket.
#pragma once

#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "files.h"
#include "google/protobuf/message_lite.h"

namespace amhex::server {

// `Send` may be called from any thread, `Receive` from one at a time.
class FrameChannel {
 public:
  enum class Outcome { kFrame, kTimeout, kWoken };

  // A frame is small: progress, reports, warnings. Meshes travel as files.
  static constexpr size_t kMaxFrameBytes = 16 << 20;

  explicit FrameChannel(UniqueFd socket) : socket_(std::move(socket)) {}

  // UNAVAILABLE when the other side is gone.
  absl::Status Send(const google::protobuf::MessageLite& message);

  // Waits for a frame, for `timeout`, or for `wake_fd` (if not -1) to become readable. UNAVAILABLE
  // when the other side is gone, DATA_LOSS when it sends no frames.
  absl::StatusOr<Outcome> Receive(google::protobuf::MessageLite* message, absl::Duration timeout,
                                  int wake_fd = -1);

 private:
  // True when a whole frame was in the buffer.
  absl::StatusOr<bool> TakeFrame(google::protobuf::MessageLite* message);
  absl::Status ReadMore();

  UniqueFd socket_;
  std::mutex send_mutex_;
  std::string buffer_;
};

}  // namespace amhex::server
