// Many clients at a server with little memory for messages: gRPC ends calls of theirs, and they
// repeat them until every job is done.
#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "amhex/client.h"
#include "fault_fixture.h"
#include "service_limits.h"
#include "sha256.h"
#include "unfinished_calls.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

// The least that the server accepts.
constexpr int64_t kMessageMemoryBytes = 32 * kMebibyte;
constexpr size_t kMessageBytes = 4 * kMebibyte - 1024;
constexpr int kClients = 16;
constexpr size_t kInputBytes = 6'000'000;
constexpr int kUnfinishedCalls = 30;
constexpr absl::Duration kQuiet = absl::Milliseconds(200);

// Half of the clients with one call, half with several.
void HaveMeshed(const std::string& address, int number) {
  client::Client client({.address = address, .patience = kPatience});
  client::EncodedInput input;
  input.encoding = amhex::v1::INPUT_ENCODING_ARRAYS;
  input.bytes =
      ScriptInput(absl::StrCat("succeed mesh", number, ";", std::string(kInputBytes, ' ')));
  if (number % 2 == 0) {
    // What the scripted worker gives is no mesh, and the client finds out.
    const absl::Status status = client.Mesh(input, {}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    return;
  }
  const absl::StatusOr<Job> job = client.Submit(input, {});
  ASSERT_TRUE(job.ok()) << job.status();
  const absl::StatusOr<Job> done = client.Watch(job->name(), {});
  ASSERT_TRUE(done.ok()) << done.status();
  const auto mesh = client.Download(done->result().mesh());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(*mesh, absl::StrCat("mesh", number));
}

TEST_F(FaultTest, NoJobIsLostWhereTheBoundOnMessagesEndsCalls) {
  Start({"--message-memory-bytes", absl::StrCat(kMessageMemoryBytes), "--workers", "2"});
  const std::string address = Port("grpc");
  std::atomic<int> clients_left = kClients;
  std::vector<std::thread> clients;
  std::multiset<std::string> due, made;
  for (int i = 0; i < kClients; ++i) {
    due.insert(Sha256Hex(absl::StrCat("mesh", i)));
    clients.emplace_back([&, i] {
      HaveMeshed(address, i);
      --clients_left;
    });
  }
  int ended_count = 0;
  while (clients_left > 0) {
    UnfinishedCalls others(address, "/amhex.v1.Blobs/WriteBlob", kUnfinishedCalls, kMessageBytes);
    others.SendUntilQuiet(kQuiet);
    ended_count += kUnfinishedCalls - others.open_count();
  }
  for (std::thread& client : clients) client.join();
  EXPECT_GT(ended_count, 0) << "the bound has not been reached";
  for (const Job& job : AllJobs()) {
    EXPECT_EQ(job.state(), Job::SUCCEEDED) << job.error().message();
    made.insert(job.result().mesh().sha256());
  }
  EXPECT_EQ(made, due) << "a job is lost or doubled";
}

}  // namespace
}  // namespace amhex::server
