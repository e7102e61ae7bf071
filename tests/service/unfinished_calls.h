// A caller who begins many calls and never ends the message of any: frames of HTTP/2 by hand, since
// no gRPC library does that. Plaintext.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "absl/time/time.h"
#include "files.h"

namespace amhex::server {

class UnfinishedCalls {
 public:
  // Connects to `address`, "host:port" with a number for the host. Each of `call_count` calls of
  // `method`, "/package.Service/Method", announces `message_bytes` and keeps back the last of them.
  UnfinishedCalls(const std::string& address, std::string method, int call_count,
                  size_t message_bytes);

  // Sends what the server permits, and answers what it wants answered, until it has permitted
  // nothing more for so long.
  void SendUntilQuiet(absl::Duration quiet);

  int64_t sent_bytes() const { return sent_bytes_; }
  // Calls that the server has not ended.
  int open_count() const { return static_cast<int>(calls_.size()); }

 private:
  struct Call {
    int64_t window = 0;
    size_t sent = 0;
  };

  void Queue(uint8_t type, uint8_t flags, uint32_t stream, const std::string& payload);
  void QueueSettings(const std::string& payload, bool is_answer);
  void OpenCalls();
  void QueueData(uint32_t stream, Call* call);
  void TakeFrames();
  void TakeFrame(uint8_t type, uint8_t flags, uint32_t stream, const std::string& payload);
  void TakeSettings(const std::string& payload);
  void TakeWindow(uint32_t stream, int64_t more);
  // True if something was sent or came within `wait`.
  bool Exchange(absl::Duration wait);

  const std::string method_;
  const size_t message_bytes_;
  UniqueFd socket_;
  std::string outgoing_;
  std::string incoming_;
  std::map<uint32_t, Call> calls_;  // by stream
  int calls_to_open_;
  uint32_t next_stream_ = 1;
  int64_t connection_window_;
  int64_t call_window_;
  int64_t sent_bytes_ = 0;
  bool is_greeted_ = false;  // the server's settings have come
};

}  // namespace amhex::server
