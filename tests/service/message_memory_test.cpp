// What callers can make the server hold in memory: calls whose messages never end, from callers
// who need not even say who they are.
#include <gtest/gtest.h>

#include <vector>

#include "absl/strings/str_cat.h"
#include "daemon_fixture.h"
#include "process_view.h"
#include "service_limits.h"
#include "unfinished_calls.h"

namespace amhex::server {
namespace {

constexpr int64_t kMessageMemoryBytes = 64 * kMebibyte;
constexpr size_t kMessageBytes = 4 * kMebibyte - 1024;
constexpr int kConnections = 4;
constexpr int kCallsPerConnection = 60;
constexpr absl::Duration kQuiet = absl::Seconds(1);
// Beside the messages: the calls' own state, what is given back late, and room to breathe. Mostly
// 20 MiB; on a busy machine 74 were seen once. Without the bound it would be 900.
constexpr int64_t kOtherBytes = 96 * kMebibyte + kQuarantineBytes;

class MessageMemoryTest : public DaemonTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(MessageMemoryTest, UnfinishedMessagesTakeNoMoreThanTheirShareAndOthersAreServed) {
  Start({absl::StrCat("--message-memory-bytes=", kMessageMemoryBytes)});
  EXPECT_FALSE(Submit("succeed mesh;").empty());
  const int64_t before = MemoryOf(pid()) * kKibibyte;
  std::vector<UnfinishedCalls> callers;
  int64_t sent_bytes = 0;
  int open_count = 0;
  for (int i = 0; i < kConnections; ++i) {
    callers.emplace_back(Port("grpc"), GetParam(), kCallsPerConnection, kMessageBytes);
  }
  for (UnfinishedCalls& caller : callers) {
    caller.SendUntilQuiet(kQuiet);
    sent_bytes += caller.sent_bytes();
  }
  for (UnfinishedCalls& caller : callers) {
    caller.SendUntilQuiet(kQuiet);  // takes what the server has said meanwhile
    open_count += caller.open_count();
  }
  // They would send several times as much, and have sent what fills the room.
  static_assert(kConnections * kCallsPerConnection * int64_t{kMessageBytes} >
                2 * (kMessageMemoryBytes + kOtherBytes));
  EXPECT_GT(sent_bytes, kMessageMemoryBytes);
  EXPECT_LE(MemoryOf(pid(), "VmHWM:") * kKibibyte - before, kMessageMemoryBytes + kOtherBytes);
  EXPECT_GT(open_count, 0) << "the others are not to be served only once all have gone";
  EXPECT_TRUE(Reaches(Submit("succeed another mesh;"), amhex::v1::Job::SUCCEEDED));
}

INSTANTIATE_TEST_SUITE_P(Methods, MessageMemoryTest,
                         ::testing::Values("/amhex.v1.Mesher/SubmitJob",
                                           "/amhex.v1.Blobs/WriteBlob"),
                         [](const auto& instance) {
                           const std::string method = instance.param;
                           return method.substr(method.rfind('/') + 1);
                         });

}  // namespace
}  // namespace amhex::server
