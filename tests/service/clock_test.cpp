// Clocks that are set, processes that stand still, and ends that come at the wrong moment.
#include "absl/time/clock.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>

#include <string>

#include "absl/strings/str_cat.h"
#include "amhex/v1/blob_service.grpc.pb.h"
#include "fault_fixture.h"
#include "files.h"
#include "job.h"
#include "process_view.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

class ClockTest : public FaultTest {
 protected:
  void StartWithClock(const std::vector<std::string>& flags) {
    SetClock(0);
    // Inherited by what is started next, and by nothing else.
    setenv("AMHEX_CLOCK_JUMP", (folder() / "jump").c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
    setenv("LD_PRELOAD", AMHEX_JUMPING_CLOCK, 1);                // NOLINT(concurrency-mt-unsafe)
    Start(flags);
    unsetenv("LD_PRELOAD");        // NOLINT(concurrency-mt-unsafe)
    unsetenv("AMHEX_CLOCK_JUMP");  // NOLINT(concurrency-mt-unsafe)
  }

  // So many hours off the true time.
  void SetClock(int hours) {
    ASSERT_TRUE(WriteFileAtomically(folder() / "jump", std::to_string(hours * 3600)).ok());
  }

  std::string QueuedJobs() {
    const std::string page = MetricsPage();
    const std::string name = "amhex_jobs{state=\"QUEUED\"} ";
    const size_t at = page.find(name);
    return at == std::string::npos ? "" : page.substr(at + name.size(), 1);
  }
};

TEST_F(ClockTest, ClockThatIsSetEndsNoJobAndStopsNoHousekeeping) {
  if (kQuarantineBytes > 0) GTEST_SKIP() << "the sanitizer must be loaded first";
  StartWithClock({"--lease-seconds", "1", "--workers", "1"});
  const std::string running = Submit(absl::StrCat("progress 1; until ", Go(), "; succeed mesh;"));
  ASSERT_TRUE(Eventually([&] { return Get(running).progress().iteration() == 1; }, kPatience));
  SetClock(5);  // beyond the lease and run_timeout
  const std::string queued = Submit("succeed other;");
  EXPECT_GT(Get(queued).create_time().seconds(), Get(running).create_time().seconds() + 4 * 3600);
  EXPECT_TRUE(Eventually([&] { return QueuedJobs() == "1"; }, kPatience));
  EXPECT_EQ(Get(running).state(), Job::RUNNING);
  EXPECT_EQ(Get(running).attempt_count(), 1);
  SetClock(-5);
  const std::string third = Submit("succeed third;");
  EXPECT_TRUE(Eventually([&] { return QueuedJobs() == "2"; }, kPatience));
  SayGo();
  ASSERT_TRUE(Reaches(running, Job::SUCCEEDED));
  EXPECT_EQ(Get(running).attempt_count(), 1);
  ASSERT_TRUE(Reaches(third, Job::SUCCEEDED));
  ASSERT_TRUE(Reaches(queued, Job::SUCCEEDED));  // long before it was submitted, by the clock
}

TEST_F(ClockTest, ServerThatIsToldToEndWaitsForNoFrozenWorker) {
  Start({"--drain-timeout", "0.1", "--workers", "1"});
  const std::string name = Submit(absl::StrCat("progress 1; until ", Go(), "; succeed mesh;"));
  ASSERT_TRUE(Eventually([&] { return Get(name).progress().iteration() == 1; }, kPatience));
  kill(ChildrenOf(pid()).at(0), SIGSTOP);
  kill(pid(), SIGTERM);
  EXPECT_EQ(Wait(), 0);
  SayGo();
  Start();
  ASSERT_TRUE(Reaches(name, Job::SUCCEEDED));
  EXPECT_EQ(Get(name).attempt_count(), 1);
}

TEST_F(ClockTest, UploadThatTheServersEndInterruptsGoesOnAtTheNext) {
  Start();
  const std::string script = ScriptInput("succeed mesh;" + std::string(3'000'000, 'x'));
  amhex::v1::WriteBlobRequest chunk;
  chunk.mutable_blob()->set_sha256(Sha256Hex(script));
  chunk.mutable_blob()->set_size_bytes(static_cast<int64_t>(script.size()));
  const size_t half = script.size() / 2;
  chunk.set_data(script.substr(0, half));
  amhex::v1::QueryWriteStatusRequest query;
  *query.mutable_blob() = chunk.blob();
  const auto committed = [&] {
    grpc::ClientContext context;
    amhex::v1::QueryWriteStatusResponse response;
    const auto blobs = amhex::v1::Blobs::NewStub(channel());
    EXPECT_TRUE(blobs->QueryWriteStatus(&context, query, &response).ok());
    return response.committed_size();
  };
  {
    const auto blobs = amhex::v1::Blobs::NewStub(channel());
    grpc::ClientContext context;
    amhex::v1::WriteBlobResponse response;
    const auto stream = blobs->WriteBlob(&context, &response);
    ASSERT_TRUE(stream->Write(chunk));
    ASSERT_TRUE(Eventually([&] { return committed() == static_cast<int64_t>(half); }, kPatience));
    kill(pid(), SIGTERM);
    EXPECT_EQ(Wait(), 0);
    EXPECT_FALSE(stream->Finish().ok());
  }
  Start();
  ASSERT_EQ(committed(), static_cast<int64_t>(half));
  chunk.set_offset(static_cast<int64_t>(half));
  chunk.set_data(script.substr(half));
  chunk.set_finish(true);
  const auto blobs = amhex::v1::Blobs::NewStub(channel());
  grpc::ClientContext context;
  amhex::v1::WriteBlobResponse response;
  const auto stream = blobs->WriteBlob(&context, &response);
  ASSERT_TRUE(stream->Write(chunk));
  stream->WritesDone();
  ASSERT_TRUE(stream->Finish().ok());
  EXPECT_TRUE(response.complete());
  amhex::v1::SubmitJobRequest request;
  request.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  *request.mutable_input_blob() = chunk.blob();
  grpc::ClientContext submitting;
  amhex::v1::SubmitJobResponse submitted;
  ASSERT_TRUE(mesher().SubmitJob(&submitting, request, &submitted).ok());
  EXPECT_TRUE(Reaches(submitted.job().name(), Job::SUCCEEDED));
}

}  // namespace
}  // namespace amhex::server
