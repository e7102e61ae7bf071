// Clients killed in the middle of a call: what they had is kept for whoever comes next, and the
// server holds nothing for them.
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "amhex/client.h"
#include "amhex/v1/blob_service.grpc.pb.h"
#include "fault_fixture.h"
#include "files.h"
#include "process_view.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr int kWorkers = 4;
constexpr int kInputBytes = 6'000'000;
constexpr int kMeshBytes = 8'000'000;

class CrashTest : public FaultTest {
 protected:
  struct Crash {
    std::string moment;
    std::string input;
    pid_t pid = 0;
    std::string Mark() const { return moment + "-mark"; }
  };

  void SetUp() override { Start({"--workers", std::to_string(kWorkers)}); }
  void TearDown() override {
    for (const Crash& crash : crashes_) End(crash);
    FaultTest::TearDown();
  }

  // Unlike any other of the test.
  static std::string Input(const std::string& what, const std::string& script) {
    return ScriptInput(absl::StrCat(script, what, ";", std::string(kInputBytes, ' ')));
  }
  std::string GoOf(int round) { return absl::StrCat(Go(), round); }

  void StartClient(const std::string& moment, std::string input) {
    const std::string path = folder() / (moment + "-input");
    ASSERT_TRUE(WriteFileAtomically(path, input).ok());
    std::remove((folder() / (moment + "-mark")).c_str());
    Crash crash{moment, std::move(input)};
    crash.pid =
        StartProcess({AMHEX_CRASHING_CLIENT, Port("grpc"), moment, path, folder() / crash.Mark()});
    ASSERT_GT(crash.pid, 0);
    crashes_.push_back(std::move(crash));
  }

  // A client for each moment, each stopped in it.
  void StartClients(int round) {
    const auto input = [round](const std::string& moment, const std::string& script) {
      return Input(absl::StrCat(moment, round), script);
    };
    const std::string waits =
        absl::StrCat("progress 1; until ", GoOf(round), "; large ", kMeshBytes, ";");
    const std::string goes = absl::StrCat("large ", kMeshBytes, ";");
    StartClient("upload", input("upload", goes));
    StartClient("watch", input("watch", waits));
    StartClient("download", input("download", goes));
    StartClient("mesh_upload", input("mesh_upload", goes));
    StartClient("mesh_watch", input("mesh_watch", waits));
    StartClient("mesh_download", input("mesh_download", goes));
    for (const Crash& crash : crashes_) {
      EXPECT_TRUE(
          Eventually([&] { return ReadWholeFile(folder() / crash.Mark()).ok(); }, kPatience))
          << crash.moment;
    }
  }

  void KillClients() {
    for (Crash& crash : crashes_) End(crash);
    killed_ = std::move(crashes_);
    crashes_.clear();
  }

  // Somebody else with the same input: nothing that was acknowledged is done twice.
  void TakeUp(const Crash& crash) {
    client::Client client({.address = Port("grpc"), .patience = kPatience});
    const std::string sha256 = Sha256Hex(crash.input);
    const bool was_uploading = crash.moment == "upload" || crash.moment == "mesh_upload";
    const amhex::v1::QueryWriteStatusResponse there = WriteStatus(crash.input);
    EXPECT_EQ(there.complete(), !was_uploading) << crash.moment;
    EXPECT_GT(there.committed_size(), 0) << crash.moment;
    const auto job = client.Submit({amhex::v1::INPUT_ENCODING_ARRAYS, crash.input}, {});
    ASSERT_TRUE(job.ok()) << job.status();
    const auto done = client.Watch(job->name(), {});
    ASSERT_TRUE(done.ok()) << done.status();
    ASSERT_EQ(done->state(), Job::SUCCEEDED) << done->error().message();
    const auto mesh = client.Download(done->result().mesh());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(static_cast<int>(mesh->size()), kMeshBytes);
  }

  amhex::v1::QueryWriteStatusResponse WriteStatus(const std::string& input) {
    grpc::ClientContext context;
    amhex::v1::QueryWriteStatusRequest request;
    request.mutable_blob()->set_sha256(Sha256Hex(input));
    request.mutable_blob()->set_size_bytes(static_cast<int64_t>(input.size()));
    amhex::v1::QueryWriteStatusResponse response;
    const auto status =
        amhex::v1::Blobs::NewStub(channel())->QueryWriteStatus(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }

  std::vector<Crash> killed_;

 private:
  static void End(const Crash& crash) {
    kill(crash.pid, SIGKILL);
    EXPECT_EQ(WaitForEnd(crash.pid), -1) << crash.moment;  // it lived until now
  }

  std::vector<Crash> crashes_;
};

TEST_F(CrashTest, ClientsKilledInEveryCallLoseNothingAndLeaveNothing) {
  constexpr int kRounds = 6;
  // After the first rounds the allocator and the libraries have what they keep for good. Each
  // round moves 80 MB; were a stream's chunks or its file kept, many times this would be missing.
  constexpr int kWarmRounds = 2;
  constexpr int64_t kMaxGrowthKilobytes = 24 * 1024 + kQuarantineBytes / 1024;
  int64_t warm_kilobytes = 0;
  for (int round = 0; round < kRounds; ++round) {
    StartClients(round);
    KillClients();
    std::ofstream(GoOf(round)) << "x";
    for (const Crash& crash : killed_) TakeUp(crash);
    ExpectNothingLeftOver();
    const auto jobs = AllJobs();
    for (const Job& job : jobs) {
      EXPECT_EQ(job.state(), Job::SUCCEEDED);
      EXPECT_LE(job.attempt_count(), 1);  // none for those that share a result
    }
    // Four of the six had submitted a job, and TakeUp one for each.
    EXPECT_EQ(static_cast<int>(jobs.size()), 10 * (round + 1));
    std::cout << "resident after round " << round << ": " << MemoryOf(pid()) << " kB\n";
    if (round == kWarmRounds - 1) warm_kilobytes = MemoryOf(pid());
  }
  EXPECT_LT(MemoryOf(pid()) - warm_kilobytes, kMaxGrowthKilobytes);
}

}  // namespace
}  // namespace amhex::server
