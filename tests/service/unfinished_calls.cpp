#include "unfinished_calls.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

#include "absl/time/clock.h"

namespace amhex::server {
namespace {

// RFC 9113, section 6.
enum FrameType : uint8_t {
  kData = 0,
  kHeaders = 1,
  kResetStream = 3,
  kSettings = 4,
  kPing = 6,
  kWindowUpdate = 8
};
constexpr uint8_t kAnswer = 1;     // flag of kSettings and kPing
constexpr uint8_t kEndStream = 1;  // flag of kHeaders and kData
constexpr uint8_t kEndHeaders = 4;
constexpr uint16_t kInitialWindowSize = 4;  // a setting
constexpr int64_t kFirstWindow = 65'535;
constexpr size_t kFrameHeadBytes = 9;
constexpr size_t kSettingBytes = 6;
constexpr int64_t kLargestFrame = 16'384;
constexpr size_t kMessageHeadBytes = 5;  // gRPC: not compressed, and the size
// What waits to be sent at a time.
constexpr size_t kMostQueued = 1 << 20;

std::string BigEndian(uint32_t number, int byte_count) {
  std::string bytes;
  for (int shift = 8 * (byte_count - 1); shift >= 0; shift -= 8) {
    bytes += static_cast<char>(number >> shift & 0xff);
  }
  return bytes;
}

uint32_t NumberAt(const std::string& bytes, size_t begin, size_t byte_count) {
  uint32_t number = 0;
  for (size_t i = begin; i < begin + byte_count; ++i) {
    number = number << 8 | static_cast<uint8_t>(bytes.at(i));
  }
  return number;
}

// A header as HPACK's literal without indexing (RFC 7541, 6.2.2); both are shorter than 127 bytes.
std::string Header(const std::string& name, const std::string& value) {
  return std::string(1, '\0') + BigEndian(static_cast<uint32_t>(name.size()), 1) + name +
         BigEndian(static_cast<uint32_t>(value.size()), 1) + value;
}

UniqueFd Connect(const std::string& address) {
  const size_t colon = address.rfind(':');
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<uint16_t>(std::stoi(address.substr(colon + 1))));
  EXPECT_EQ(inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr), 1) << address;
  UniqueFd fd(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_EQ(connect(fd.get(), reinterpret_cast<const sockaddr*>(&to), sizeof(to)), 0) << address;
  fcntl(fd.get(), F_SETFL, O_NONBLOCK);
  return fd;
}

}  // namespace

UnfinishedCalls::UnfinishedCalls(const std::string& address, std::string method, int call_count,
                                 size_t message_bytes)
    : method_(std::move(method)),
      message_bytes_(message_bytes),
      socket_(Connect(address)),
      outgoing_("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"),
      calls_to_open_(call_count),
      connection_window_(kFirstWindow),
      call_window_(kFirstWindow) {
  Queue(kSettings, 0, 0, "");
}

void UnfinishedCalls::Queue(uint8_t type, uint8_t flags, uint32_t stream,
                            const std::string& payload) {
  outgoing_ += BigEndian(static_cast<uint32_t>(payload.size()), 3) + BigEndian(type, 1) +
               BigEndian(flags, 1) + BigEndian(stream, 4) + payload;
}

void UnfinishedCalls::OpenCalls() {
  if (!is_greeted_) return;
  for (; calls_to_open_ > 0; --calls_to_open_, next_stream_ += 2) {
    Queue(kHeaders, kEndHeaders, next_stream_,
          Header(":method", "POST") + Header(":scheme", "http") + Header(":path", method_) +
              Header(":authority", "localhost") + Header("content-type", "application/grpc") +
              Header("te", "trailers"));
    calls_[next_stream_] = {call_window_, 0};
  }
}

void UnfinishedCalls::QueueData(uint32_t stream, Call* call) {
  const size_t end = kMessageHeadBytes + message_bytes_ - 1;
  while (call->sent < end && outgoing_.size() < kMostQueued) {
    const int64_t size = std::min(
        {kLargestFrame, connection_window_, call->window, static_cast<int64_t>(end - call->sent)});
    if (size <= 0) return;
    std::string data(static_cast<size_t>(size), '\n');
    if (call->sent == 0) {
      const std::string head =
          BigEndian(0, 1) + BigEndian(static_cast<uint32_t>(message_bytes_), 4);
      data.replace(0, head.size(), head);
    }
    Queue(kData, 0, stream, data);
    call->sent += data.size();
    call->window -= size;
    connection_window_ -= size;
    sent_bytes_ += size;
  }
}

void UnfinishedCalls::TakeFrames() {
  size_t begin = 0;
  while (incoming_.size() - begin >= kFrameHeadBytes) {
    const size_t size = NumberAt(incoming_, begin, 3);
    if (incoming_.size() - begin < kFrameHeadBytes + size) break;
    TakeFrame(static_cast<uint8_t>(incoming_[begin + 3]),
              static_cast<uint8_t>(incoming_[begin + 4]), NumberAt(incoming_, begin + 5, 4),
              incoming_.substr(begin + kFrameHeadBytes, size));
    begin += kFrameHeadBytes + size;
  }
  incoming_.erase(0, begin);
}

void UnfinishedCalls::TakeFrame(uint8_t type, uint8_t flags, uint32_t stream,
                                const std::string& payload) {
  if (type == kSettings && (flags & kAnswer) == 0) TakeSettings(payload);
  if (type == kPing && (flags & kAnswer) == 0) Queue(kPing, kAnswer, 0, payload);
  if (type == kWindowUpdate) TakeWindow(stream, NumberAt(payload, 0, 4));
  if (type == kResetStream || (type == kHeaders && (flags & kEndStream) != 0)) {
    calls_.erase(stream);
  }
}

void UnfinishedCalls::TakeSettings(const std::string& payload) {
  for (size_t begin = 0; begin < payload.size(); begin += kSettingBytes) {
    if (NumberAt(payload, begin, 2) != kInitialWindowSize) continue;
    const int64_t window = NumberAt(payload, begin + 2, 4);
    for (auto& [stream, call] : calls_) call.window += window - call_window_;
    call_window_ = window;
  }
  is_greeted_ = true;
  Queue(kSettings, kAnswer, 0, "");
}

void UnfinishedCalls::TakeWindow(uint32_t stream, int64_t more) {
  if (stream == 0) connection_window_ += more;
  if (const auto call = calls_.find(stream); call != calls_.end()) call->second.window += more;
}

bool UnfinishedCalls::Exchange(absl::Duration wait) {
  pollfd events{socket_.get(), POLLIN, 0};
  if (!outgoing_.empty()) events.events |= POLLOUT;
  if (poll(&events, 1, static_cast<int>(absl::ToInt64Milliseconds(wait))) <= 0) return false;
  bool has_moved = false;
  const ssize_t sent = send(socket_.get(), outgoing_.data(), outgoing_.size(), MSG_NOSIGNAL);
  if (sent > 0) {
    outgoing_.erase(0, static_cast<size_t>(sent));
    has_moved = true;
  }
  std::array<char, 1 << 16> room;
  const ssize_t got = recv(socket_.get(), room.data(), room.size(), 0);
  if (got > 0) {
    incoming_.append(room.data(), static_cast<size_t>(got));
    has_moved = true;
  }
  return has_moved;
}

void UnfinishedCalls::SendUntilQuiet(absl::Duration quiet) {
  absl::Time end = absl::Now() + quiet;
  while (absl::Now() < end) {
    OpenCalls();
    for (auto& [stream, call] : calls_) QueueData(stream, &call);
    if (Exchange(end - absl::Now())) end = absl::Now() + quiet;
    TakeFrames();
  }
}

}  // namespace amhex::server
