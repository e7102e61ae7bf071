// Processes killed, connections cut, clients gone: nothing is lost, nothing doubled, nothing left
// over. Real amhexd, the real client library, and workers that follow scripts or are real.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "amhex/client.h"
#include "amhex/v1/blob_service.grpc.pb.h"
#include "cuttable_proxy.h"
#include "fault_fixture.h"
#include "process_view.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;
using amhex::v1::Stage;

constexpr int kFirstStage = amhex::v1::STAGE_DECODE_INPUT;
constexpr int kLastStage = amhex::v1::STAGE_ENCODE_RESULT;

// Faults between and within processes, stage by stage.
class StageFaultTest : public FaultTest {
 protected:
  // A job for each stage, all running, each waiting in its own.
  std::map<Stage, std::string> StartAJobInEachStage() {
    std::map<Stage, std::string> jobs;
    for (int stage = kFirstStage; stage <= kLastStage; ++stage) {
      jobs[static_cast<Stage>(stage)] =
          Submit(absl::StrCat("at ", stage, "; until ", Go(), "; succeed mesh", stage, ";"));
    }
    AwaitStages(jobs);
    return jobs;
  }

  void AwaitStages(const std::map<Stage, std::string>& jobs) {
    for (const auto& job : jobs) {
      const auto is_there = [&] { return Get(job.second).progress().stage() == job.first; };
      EXPECT_TRUE(Eventually(is_there, kPatience)) << Stage_Name(job.first);
    }
  }

  void ExpectAllSucceedOnce(const std::map<Stage, std::string>& jobs, int attempts) {
    for (const auto& [stage, name] : jobs) {
      ASSERT_TRUE(Reaches(name, Job::SUCCEEDED)) << Stage_Name(stage);
      const Job job = Get(name);
      EXPECT_EQ(job.attempt_count(), attempts) << Stage_Name(stage);
      EXPECT_EQ(job.result().mesh().sha256(), Sha256Hex(absl::StrCat("mesh", stage)));
    }
  }

  std::vector<std::string> WorkersForAll() {
    return {"--workers", std::to_string(kLastStage), "--running-memory-bytes", "0"};
  }
};

TEST_F(StageFaultTest, ServerKilledInEveryStageSpendsNoAttempt) {
  Start(WorkersForAll());
  const auto jobs = StartAJobInEachStage();
  kill(pid(), SIGKILL);
  EXPECT_EQ(Wait(), -1);
  Start(WorkersForAll());
  AwaitStages(jobs);
  SayGo();
  ExpectAllSucceedOnce(jobs, 1);
}

TEST_F(StageFaultTest, WorkersKilledInEveryStageSpendOneAttempt) {
  Start(WorkersForAll());
  const auto jobs = StartAJobInEachStage();
  const std::vector<pid_t> workers = ChildrenOf(pid());
  EXPECT_EQ(workers.size(), jobs.size());
  for (const pid_t worker : workers) kill(worker, SIGKILL);
  SayGo();
  ExpectAllSucceedOnce(jobs, 2);
}

TEST_F(FaultTest, FrozenServerGoesOnWhereItStopped) {
  Start({"--lease-seconds", "3"});  // so that a busy machine alone ends none
  const std::string name = Submit("progress 1; until " + Go() + "; succeed mesh;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid(), SIGSTOP);
  absl::SleepFor(absl::Milliseconds(4000));  // beyond the lease: that is the fault, not a deadline
  kill(pid(), SIGCONT);
  SayGo();
  ASSERT_TRUE(Reaches(name, Job::SUCCEEDED));
  EXPECT_EQ(Get(name).attempt_count(), 1);
  EXPECT_EQ(Get(name).result().mesh().sha256(), Sha256Hex("mesh"));
}

TEST_F(FaultTest, FrozenWorkerLosesItsJobToTheNext) {
  Start({"--lease-seconds", "1"});
  const std::string name = Submit("progress 1; until " + Go() + "; succeed mesh;");
  ASSERT_TRUE(Eventually([&] { return Get(name).progress().iteration() == 1; }, kPatience));
  kill(ChildrenOf(pid()).at(0), SIGSTOP);
  ASSERT_TRUE(Eventually([&] { return Get(name).attempt_count() == 2; }, kPatience));
  SayGo();
  ASSERT_TRUE(Reaches(name, Job::SUCCEEDED));
  EXPECT_EQ(Get(name).result().mesh().sha256(), Sha256Hex("mesh"));
}

// A client whose way to the server a test can cut.
class CutTest : public FaultTest {
 protected:
  void StartBehindProxy() {
    Start();
    const std::string address = Port("grpc");
    proxy_ = std::make_unique<CuttableProxy>(address.substr(0, address.rfind(':')),
                                             std::stoi(address.substr(address.rfind(':') + 1)));
    client_ = std::make_unique<client::Client>(client::ClientOptions{
        .address = absl::StrCat("127.0.0.1:", proxy_->port()), .patience = kPatience});
  }
  void TearDown() override {
    JoinStalls();
    client_.reset();
    proxy_.reset();
    FaultTest::TearDown();
  }

  // Breaks every connection the first time the bytes pass a third, stalls them at two thirds and
  // breaks them then.
  std::function<void(int64_t, int64_t)> BreakingAndStalling() {
    auto moment = std::make_shared<int>(0);
    return [this, moment](int64_t have, int64_t whole) {
      if (*moment == 0 && have > whole / 3) {
        *moment = 1;
        proxy_->Mend();
      } else if (*moment == 1 && have > whole / 3 * 2) {
        *moment = 2;
        proxy_->Cut();
        stalls_.emplace_back([this] {
          absl::SleepFor(absl::Milliseconds(300));
          proxy_->Mend();
        });
      }
    };
  }
  void JoinStalls() {
    for (std::thread& stall : stalls_) stall.join();
    stalls_.clear();
  }

  std::unique_ptr<CuttableProxy> proxy_;
  std::unique_ptr<client::Client> client_;
  std::vector<std::thread> stalls_;
};

TEST_F(CutTest, UploadWatchAndDownloadSurviveCutAndStalledConnections) {
  StartBehindProxy();
  client::EncodedInput input;
  input.encoding = amhex::v1::INPUT_ENCODING_ARRAYS;
  input.bytes = ScriptInput("progress 1; until " + Go() + "; progress 2; large 12000000; " +
                            std::string(12'000'000, ' '));
  client::SubmitOptions submit;
  submit.on_upload = BreakingAndStalling();
  const auto job = client_->Submit(input, {}, submit);
  JoinStalls();
  ASSERT_TRUE(job.ok()) << job.status();

  client::WatchOptions watch;
  std::vector<int64_t> seen;
  bool has_broken = false;
  watch.on_frame = [&](const amhex::v1::WatchJobResponse& frame) {
    seen.push_back(frame.seq());
    if ((frame.has_progress() || frame.job().has_progress()) && !has_broken) {
      has_broken = true;
      proxy_->Mend();
    }
  };
  watch.on_reconnect = [&](const absl::Status&) { SayGo(); };
  const auto done = client_->Watch(job->name(), watch);
  ASSERT_TRUE(done.ok()) << done.status();
  ASSERT_EQ(done->state(), Job::SUCCEEDED) << done->error().message();
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(done->attempt_count(), 1);

  const auto mesh = client_->Download(done->result().mesh(), BreakingAndStalling());
  JoinStalls();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(*mesh, std::string(12'000'000, 'x'));
  const auto jobs = client_->ListJobs(10);
  ASSERT_TRUE(jobs.ok());
  EXPECT_EQ(jobs->size(), 1u);
}

TEST_F(FaultTest, SlowWatcherGetsFewerFramesAndHoldsNothingUp) {
  Start();
  std::string script;
  constexpr int kFrames = 20'000;
  for (int i = 1; i <= kFrames; ++i) absl::StrAppend(&script, "progress ", i, ";");
  const std::string name = Submit("until " + Go() + ";" + script + "succeed mesh;");
  grpc::ClientContext context;
  amhex::v1::WatchJobRequest request;
  request.set_name(name);
  const auto stream = mesher().WatchJob(&context, request);
  amhex::v1::WatchJobResponse frame;
  ASSERT_TRUE(stream->Read(&frame));
  SayGo();
  // The job ends while this watcher reads nothing.
  ASSERT_TRUE(Eventually([&] { return Get(name).state() == Job::SUCCEEDED; }, kPatience));
  int progress_frames = 0;
  while (stream->Read(&frame)) progress_frames += frame.has_progress() ? 1 : 0;
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(frame.job().state(), Job::SUCCEEDED);
  EXPECT_LT(progress_frames, kFrames);
}

TEST_F(FaultTest, ParallelDownloadsTakeTheMemoryOfAFewChunksEach) {
  Start();
  constexpr int64_t kBytes = 60'000'000;
  constexpr int kReaders = 8;
  const std::string name = Submit(absl::StrCat("large ", kBytes, ";"));
  ASSERT_TRUE(Reaches(name, Job::SUCCEEDED));
  const int64_t before = MemoryOf(pid(), "VmHWM:");
  const auto blobs = amhex::v1::Blobs::NewStub(channel());
  std::vector<std::thread> readers;
  std::atomic<int64_t> received{0};
  for (int i = 0; i < kReaders; ++i) {
    readers.emplace_back([&, slow = i % 2 == 1] {
      grpc::ClientContext context;
      amhex::v1::ReadBlobRequest request;
      *request.mutable_blob() = Get(name).result().mesh();
      const auto stream = blobs->ReadBlob(&context, request);
      for (amhex::v1::ReadBlobResponse chunk; stream->Read(&chunk);) {
        received += static_cast<int64_t>(chunk.data().size());
        if (slow) absl::SleepFor(absl::Milliseconds(5));  // the server must wait, not collect
      }
      EXPECT_TRUE(stream->Finish().ok());
    });
  }
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(received, kReaders * kBytes);
  // Each stream has a chunk of 1 MiB being read and what the transport holds of it; twice that for
  // the allocator. All the blobs together would be 480 MB.
  EXPECT_LT(MemoryOf(pid(), "VmHWM:") - before, kReaders * 8 * 1024 + kQuarantineBytes / 1024);
}

}  // namespace
}  // namespace amhex::server
