// The real worker and the real engine, killed in every stage; and disks that are full.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "amhex/v1/blob_service.grpc.pb.h"
#include "error_reason.h"
#include "errors.h"
#include "fault_fixture.h"
#include "files.h"
#include "job.h"
#include "process_view.h"
#include "sha256.h"

namespace amhex::server {
namespace {

namespace fs = std::filesystem;
using amhex::v1::Job;
using amhex::v1::Stage;

constexpr int kFirstStage = amhex::v1::STAGE_DECODE_INPUT;
constexpr int kLastStage = amhex::v1::STAGE_ENCODE_RESULT;

class RealFaultTest : public FaultTest {
 protected:
  void SetUp() override {
    fs::create_directory(folder() / "fatal");
    setenv("AMHEX_FATAL_STAGES", (folder() / "fatal").c_str(), 1);
  }
  void TearDown() override {
    FaultTest::TearDown();
    unsetenv("AMHEX_FATAL_STAGES");
  }

  void StartReal() {
    Start({"--worker", AMHEX_FATAL_STAGE_WORKER, "--max-attempts", "40", "--lease-seconds", "1"});
  }
  std::string Fatal(const std::string& victim, int stage) {
    return folder() / absl::StrCat("fatal/", victim, "-", stage);
  }

  std::string SubmitCube() {
    amhex::v1::SubmitJobRequest request;
    request.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
    request.set_inline_input(CubeInput());
    request.set_skip_cache(true);
    request.mutable_params()->mutable_sizing()->set_cell_count(64);
    grpc::ClientContext context;
    amhex::v1::SubmitJobResponse response;
    const auto status = mesher().SubmitJob(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.job().name();
  }
  // The digest of the mesh that becomes of the job.
  std::string MeshOf(const std::string& name) {
    EXPECT_TRUE(Reaches(name, Job::SUCCEEDED)) << Get(name).error().message();
    return Get(name).result().mesh().sha256();
  }
};

// Every stage has its death: of one of these jobs, or of a second attempt at one.
TEST_F(RealFaultTest, WorkerKilledInEveryStageGivesTheSameMesh) {
  StartReal();
  const std::string undisturbed = MeshOf(SubmitCube());
  int attempts = 0;
  std::vector<std::string> jobs;
  for (int stage = kFirstStage; stage <= kLastStage; ++stage) {
    std::ofstream(Fatal("worker", stage)) << "x";
  }
  for (int stage = kFirstStage; stage <= kLastStage; ++stage) jobs.push_back(SubmitCube());
  for (const std::string& name : jobs) {
    EXPECT_EQ(MeshOf(name), undisturbed);
    attempts += Get(name).attempt_count();
  }
  EXPECT_TRUE(FilesIn(folder() / "fatal").empty());
  EXPECT_EQ(attempts, 2 * static_cast<int>(jobs.size()));  // each death cost one
}

TEST_F(RealFaultTest, ServerKilledInEveryStageGivesTheSameMeshInTheSameAttempt) {
  StartReal();
  const std::string undisturbed = MeshOf(SubmitCube());
  for (int stage = kFirstStage; stage <= kLastStage; ++stage) {
    std::ofstream(Fatal("server", stage)) << "x";
    const std::string name = SubmitCube();
    EXPECT_EQ(Wait(), -1) << Stage_Name(static_cast<Stage>(stage));
    StartReal();
    EXPECT_EQ(MeshOf(name), undisturbed) << Stage_Name(static_cast<Stage>(stage));
    EXPECT_EQ(Get(name).attempt_count(), 1) << Stage_Name(static_cast<Stage>(stage));
  }
}

// Its decoder, its engine and its writer, each frozen beyond the lease.
TEST_F(RealFaultTest, FrozenWorkerLosesItsJobAndTheNextGivesTheSameMesh) {
  StartReal();
  const std::string undisturbed = MeshOf(SubmitCube());
  constexpr int kStages[] = {kFirstStage, amhex::v1::STAGE_PLACE_VERTICES, kLastStage};
  for (const int stage : kStages) {
    std::ofstream(Fatal("frozen", stage)) << "x";
    const std::string name = SubmitCube();
    EXPECT_EQ(MeshOf(name), undisturbed) << Stage_Name(static_cast<Stage>(stage));
    EXPECT_EQ(Get(name).attempt_count(), 2) << Stage_Name(static_cast<Stage>(stage));
  }
}

TEST_F(RealFaultTest, FrozenWorkerDiesWithItsServer) {
  Start({"--worker", AMHEX_REAL_WORKER});
  const std::vector<pid_t> workers = ChildrenOf(pid());
  ASSERT_EQ(workers.size(), 1u);
  kill(workers[0], SIGSTOP);
  const std::string name = SubmitCube();
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid(), SIGKILL);
  EXPECT_EQ(Wait(), -1);
  EXPECT_TRUE(Eventually([&] { return kill(workers[0], 0) != 0; }, kPatience));
  Start({"--worker", AMHEX_REAL_WORKER});
  EXPECT_NE(MeshOf(name), "");
  EXPECT_EQ(Get(name).attempt_count(), 1);
}

// A data folder on a file system of its own, which a test can fill to the last byte.
class FullDiskTest : public FaultTest {
 protected:
  static constexpr int kDiskBytes = 16 << 20;
  static constexpr int kReserve = 4 << 20;
  static constexpr int kInputBytes = 1'000'000;

  void SetUp() override {
    fs::create_directory(folder() / "data");
    const std::string size = "size=" + std::to_string(kDiskBytes);
    if (mount("tmpfs", (folder() / "data").c_str(), "tmpfs", 0, size.c_str()) != 0) {
      GTEST_SKIP() << "no file system can be mounted here";
    }
    LogTo(folder() / "log");
    Start({"--lease-seconds", "1", "--min-free-disk-bytes", std::to_string(kReserve)});
  }
  void TearDown() override {
    FaultTest::TearDown();
    umount2((folder() / "data").c_str(), MNT_DETACH);
  }

  void Fill() {
    std::ofstream filler(folder() / "data/filler", std::ios::binary);
    const std::string block(4096, 'x');
    while (filler.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
    }
  }
  void MakeRoom() { fs::remove(folder() / "data/filler"); }

  // The reason of the error that uploading `bytes` gives; empty if there is none.
  std::string Upload(const std::string& bytes) {
    grpc::ClientContext context;
    amhex::v1::WriteBlobResponse response;
    const auto stub = amhex::v1::Blobs::NewStub(channel());
    const auto writer = stub->WriteBlob(&context, &response);
    amhex::v1::WriteBlobRequest request;
    request.mutable_blob()->set_sha256(Sha256Hex(bytes));
    request.mutable_blob()->set_size_bytes(static_cast<int64_t>(bytes.size()));
    request.set_data(bytes);
    request.set_finish(true);
    writer->Write(request);
    writer->WritesDone();
    return Reason(writer->Finish());
  }
  std::string TrySubmit(const std::string& script) {
    grpc::ClientContext context;
    amhex::v1::SubmitJobResponse response;
    return Reason(mesher().SubmitJob(&context, ScriptRequest(script), &response));
  }
};

TEST_F(FullDiskTest, UploadsAndSubmissionsAreRefusedUntilThereIsRoom) {
  const std::string input = ScriptInput("succeed mesh; " + std::string(3'000'000, ' '));
  Fill();
  EXPECT_EQ(Upload(input), "STORAGE_FULL");
  EXPECT_EQ(TrySubmit("succeed mesh;"), "STORAGE_FULL");
  EXPECT_TRUE(AllJobs().empty());
  MakeRoom();
  EXPECT_EQ(Upload(input), "");
  amhex::v1::SubmitJobRequest request;
  request.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  request.mutable_input_blob()->set_sha256(Sha256Hex(input));
  request.mutable_input_blob()->set_size_bytes(static_cast<int64_t>(input.size()));
  grpc::ClientContext context;
  amhex::v1::SubmitJobResponse response;
  ASSERT_TRUE(mesher().SubmitJob(&context, request, &response).ok());
  EXPECT_TRUE(Reaches(response.job().name(), Job::SUCCEEDED));
}

TEST_F(FullDiskTest, InputsAreRefusedWhileAcceptedJobsCanStillEnd) {
  // Takes room for its result once no more inputs fit.
  Submit("until " + Go() + "; large " + std::to_string(kReserve / 2) + ";");
  const std::string padding(kInputBytes, ' ');
  int accepted = 0;
  std::string refusal;
  while (refusal.empty() && accepted < kDiskBytes / kInputBytes) {
    refusal = TrySubmit("succeed " + std::to_string(accepted) + ";" + padding);
    accepted += refusal.empty() ? 1 : 0;
  }
  EXPECT_EQ(refusal, "STORAGE_FULL");
  EXPECT_GE(accepted, 2);
  EXPECT_EQ(Upload(ScriptInput("succeed mesh;" + padding)), "STORAGE_FULL");
  SayGo();
  const auto jobs = AllJobs();
  EXPECT_EQ(jobs.size(), static_cast<size_t>(accepted) + 1);
  for (const Job& job : jobs) EXPECT_TRUE(Reaches(job.name(), Job::SUCCEEDED)) << job.name();
}

TEST_F(FullDiskTest, JobWhoseEndCannotBeRecordedIsNotLost) {
  const std::string name = Submit("progress 1; until " + Go() + "; large 100000;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  Fill();
  SayGo();
  ASSERT_TRUE(Eventually(
      [&] {
        const auto log = ReadWholeFile(folder() / "log");
        const bool unrecorded = log.ok() && log->find("finish_not_recorded") != std::string::npos;
        return unrecorded || IsFinal(Get(name).state());
      },
      kPatience));
  MakeRoom();
  ASSERT_TRUE(Eventually([&] { return IsFinal(Get(name).state()); }, kPatience));
  // It ran again, or the last bytes of the disk sufficed to record that it failed for want of room.
  if (Get(name).state() != Job::SUCCEEDED) {
    EXPECT_EQ(ReasonOf(Get(name).error()), "STORAGE_FULL");
  }
}

}  // namespace
}  // namespace amhex::server
