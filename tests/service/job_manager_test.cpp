// The job manager and the worker pool with real child processes that follow scripts.
#include "job_manager.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <thread>

#include "errors.h"
#include "job_manager_fixture.h"
#include "job_record.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

TEST_F(JobManagerTest, JobRunsAndItsResultIsABlobWithStagesStored) {
  Start();
  const std::string id = Submit("progress 1; stage; succeed mesh;");
  const Job job = Finished(id);
  ASSERT_EQ(job.state(), Job::SUCCEEDED) << job.error().message();
  EXPECT_EQ(job.stages_size(), 1);
  EXPECT_EQ(*ReadWholeFile(manager_->PathOfBlob(job.result().mesh().sha256())), "mesh");
  EXPECT_EQ(job.attempt_count(), 1);
}

TEST_F(JobManagerTest, FailedJobCarriesReasonAndStage) {
  Start();
  const Job job = Finished(Submit("progress 1; fail;"));
  EXPECT_EQ(job.state(), Job::FAILED);
  EXPECT_EQ(ReasonOf(job.error()), "INPUT_INVALID");
  EXPECT_EQ(job.failed_stage(), amhex::v1::STAGE_RELAX);
}

TEST_F(JobManagerTest, KilledWorkerCostsOneAttemptAndIsReplaced) {
  Start();
  const std::string id = Submit("once " + (folder_ / "mark") + "; succeed mesh;");
  const Job job = Finished(id);
  EXPECT_EQ(job.state(), Job::SUCCEEDED);
  EXPECT_EQ(job.attempt_count(), 2);
}

TEST_F(JobManagerTest, JobWhoseWorkerAlwaysDiesFailsAfterTheLastAttempt) {
  Start();
  const Job job = Finished(Submit("progress 1; touch " + (folder_ / "log") + "; kill;"));
  EXPECT_EQ(job.state(), Job::FAILED);
  EXPECT_EQ(ReasonOf(job.error()), "ATTEMPTS_EXHAUSTED");
  EXPECT_EQ(LinesOf(folder_ / "log"), options_.limits.max_attempts);
}

TEST_F(JobManagerTest, InputThatCrashesTheDecoderFailsAtOnce) {
  Start();
  const Job job = Finished(Submit("decode; abort;"));
  EXPECT_EQ(job.state(), Job::FAILED);
  EXPECT_EQ(ReasonOf(job.error()), "INPUT_DECODE_LIMIT");
  EXPECT_EQ(job.attempt_count(), 1);
}

TEST_F(JobManagerTest, InputThatKeepsTheDecoderBusyFailsOnce) {
  Start();
  const Job job = Finished(Submit("decode; deaf 60000; succeed mesh;"));
  EXPECT_EQ(job.state(), Job::FAILED);
  EXPECT_EQ(ReasonOf(job.error()), "INPUT_DECODE_LIMIT");
  EXPECT_EQ(job.attempt_count(), 1);
  EXPECT_EQ(Finished(Submit("decode; progress 1; deaf 2500; succeed mesh;")).state(),
            Job::SUCCEEDED);
}

TEST_F(JobManagerTest, OtherJobsRunAfterACrash) {
  Start();
  const std::string bad = Submit("decode; abort;");
  const std::string good = Submit("succeed mesh;");
  EXPECT_EQ(Finished(bad).state(), Job::FAILED);
  EXPECT_EQ(Finished(good).state(), Job::SUCCEEDED);
}

TEST_F(JobManagerTest, CancelStopsARunningJob) {
  Start();
  const std::string id = Submit("progress 7; sleep 60000; succeed mesh;");
  ASSERT_TRUE(ReachesIteration(id, 7));
  ASSERT_TRUE(manager_->Cancel(Everyone(), id).ok());
  const Job job = Finished(id);
  EXPECT_EQ(job.state(), Job::CANCELLED);
  EXPECT_EQ(ReasonOf(job.error()), "CANCEL_REQUESTED");
}

// Else it would wait in the queue of the next server, though its cancel was acknowledged.
TEST_F(JobManagerTest, JobCancelledWhileTheServerInterruptsItIsNotQueuedAgain) {
  Start();
  const std::string id = Submit("progress 7; deaf 60000; succeed mesh;");
  ASSERT_TRUE(ReachesIteration(id, 7));
  manager_->StartDraining();
  std::thread stopping([this] { pool_->Stop(absl::Now()); });
  absl::SleepFor(absl::Milliseconds(100));  // of the 300 that the pool waits for a deaf worker
  EXPECT_TRUE(manager_->Cancel(Everyone(), id).ok());
  stopping.join();
  EXPECT_EQ(Get(id).state(), Job::CANCELLED);
}

TEST_F(JobManagerTest, WorkerThatIgnoresCancelIsKilled) {
  Start();
  const std::string id = Submit("progress 7; deaf 60000; succeed mesh;");
  ASSERT_TRUE(ReachesIteration(id, 7));
  ASSERT_TRUE(manager_->Cancel(Everyone(), id).ok());
  EXPECT_EQ(Finished(id).state(), Job::CANCELLED);
  EXPECT_EQ(Finished(Submit("succeed mesh;")).state(), Job::SUCCEEDED);
}

TEST_F(JobManagerTest, CancelledQueuedJobNeverRuns) {
  Start();
  const std::string blocker = Submit("progress 7; sleep 60000;");
  ASSERT_TRUE(ReachesIteration(blocker, 7));
  const std::string id = Submit("touch " + (folder_ / "log") + "; succeed mesh;");
  const auto cancelled = manager_->Cancel(Everyone(), id);
  ASSERT_TRUE(cancelled.ok());
  EXPECT_EQ(cancelled->state(), Job::CANCELLED);
  ASSERT_TRUE(manager_->Cancel(Everyone(), blocker).ok());
  EXPECT_EQ(Finished(Submit("succeed mesh;")).state(), Job::SUCCEEDED);
  EXPECT_EQ(LinesOf(folder_ / "log"), 0);
}

TEST_F(JobManagerTest, RunTimeoutEndsEvenADeafWorker) {
  Start();
  auto request = ScriptRequest("deaf 60000;");
  request.mutable_run_timeout()->set_nanos(50'000'000);
  const auto submitted = manager_->Submit(Everyone(), request);
  ASSERT_TRUE(submitted.ok());
  const Job job = Finished(JobIdFromName(submitted->name()));
  EXPECT_EQ(job.state(), Job::FAILED);
  EXPECT_EQ(ReasonOf(job.error()), "RUN_TIMEOUT");
}

TEST_F(JobManagerTest, QueueTimeoutEndsAWaitingJob) {
  Start();
  const std::string blocker = Submit("progress 7; sleep 60000;");
  ASSERT_TRUE(ReachesIteration(blocker, 7));
  auto request = ScriptRequest("succeed mesh;");
  request.mutable_queue_timeout()->set_nanos(10'000'000);
  const auto submitted = manager_->Submit(Everyone(), request);
  ASSERT_TRUE(submitted.ok());
  const Job job = Finished(JobIdFromName(submitted->name()));
  EXPECT_EQ(ReasonOf(job.error()), "QUEUE_TIMEOUT");
}

TEST_F(JobManagerTest, DrainGivesRunningJobsBackAndTheNextServerRunsThem) {
  Start();
  const std::string id = Submit("progress 7; once " + (folder_ / "never") + "; succeed mesh;");
  const std::string slow =
      Submit("touch " + (folder_ / "log") + "; progress 7; sleep 60000; succeed mesh;");
  EXPECT_EQ(Finished(id).attempt_count(), 2);
  ASSERT_TRUE(ReachesIteration(slow, 7));
  Stop(absl::ZeroDuration());
  Start();
  ASSERT_TRUE(ReachesIteration(slow, 7));
  EXPECT_EQ(Get(slow).attempt_count(), 1);
  EXPECT_EQ(LinesOf(folder_ / "log"), 2);
}

TEST_F(JobManagerTest, DrainLetsRunningJobsFinishInTime) {
  Start();
  const std::string id = Submit("progress 7; deaf 300; succeed mesh;");
  ASSERT_TRUE(ReachesIteration(id, 7));
  Stop(absl::Seconds(20));
  Start();
  EXPECT_EQ(Get(id).state(), Job::SUCCEEDED);
}

TEST_F(JobManagerTest, DrainingManagerRefusesNewJobs) {
  Start();
  manager_->StartDraining();
  const auto refused = manager_->Submit(Everyone(), ScriptRequest("succeed mesh;"));
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(ReasonOf(refused.status()), "SERVER_DRAINING");
}

TEST_F(JobManagerTest, ManyJobsOnSeveralWorkersAllSucceedOnce) {
  Start(3);
  std::vector<std::string> ids;
  for (int i = 0; i < 30; ++i) {
    ids.push_back(Submit("touch " + (folder_ / "log") + "; progress 1; stage; succeed mesh;"));
  }
  for (const std::string& id : ids) EXPECT_EQ(Finished(id).state(), Job::SUCCEEDED);
  EXPECT_EQ(LinesOf(folder_ / "log"), 30);
}

TEST_F(JobManagerTest, KillingWorkersFromOutsideLosesNoJob) {
  Start(2);
  options_.limits.max_attempts = 3;
  std::vector<std::string> ids;
  for (int i = 0; i < 10; ++i) ids.push_back(Submit("progress 1; sleep 30; succeed mesh;"));
  for (int round = 0; round < 2; ++round) {
    for (const pid_t pid : pool_->pids()) kill(pid, SIGKILL);
    absl::SleepFor(absl::Milliseconds(100));
  }
  for (const std::string& id : ids) EXPECT_EQ(Finished(id).state(), Job::SUCCEEDED);
}

// Hears that there may be news, and forgets it.
class DeafListener : public FeedListener {
 public:
  void Wake() override {}
};

TEST_F(JobManagerTest, WatchersHearOfAJobAlsoWhileNothingHappensToIt) {
  EXPECT_LE(options_.quiet_feed_interval, absl::Seconds(14));  // of 15, a tick and the way to them
  options_.quiet_feed_interval = absl::Milliseconds(20);
  Start();
  const std::string go = folder_ / "go";
  const std::string silent = Submit("progress 7; until " + go + "; succeed mesh;");
  ASSERT_TRUE(ReachesIteration(silent, 7));
  const std::string waiting = Submit("succeed mesh;");
  for (const std::string& id : {silent, waiting}) {
    amhex::v1::WatchJobRequest request;
    request.set_name(JobName(id));
    const auto reader = manager_->Watch(Everyone(), request, std::make_shared<DeafListener>());
    ASSERT_TRUE(reader.ok()) << reader.status();
    for (int frames = 0; frames < 5; ++frames) {
      FeedReader::Item item;
      ASSERT_TRUE(Eventually([&] {
        item = (*reader)->Next(absl::Now());
        return item.frame.has_value();
      }));
      EXPECT_EQ(item.frame->job().state(), id == silent ? Job::RUNNING : Job::QUEUED);
    }
  }
  std::ofstream(go) << "x";
  EXPECT_EQ(Finished(waiting).state(), Job::SUCCEEDED);
}

// The end is stored, and told a moment later; in between anybody may remove the job.
TEST_F(JobManagerTest, WatchersLeaveAJobThatIsRemovedBeforeTheyHearOfItsEnd) {
  options_.quiet_feed_interval = absl::Milliseconds(20);
  for (const bool by_this_server : {true, false}) {
    Start();
    const std::string id = Submit("progress 7; sleep 60000;");
    ASSERT_TRUE(ReachesIteration(id, 7));
    amhex::v1::WatchJobRequest request;
    request.set_name(JobName(id));
    auto reader = manager_->Watch(Everyone(), request, std::make_shared<DeafListener>());
    ASSERT_TRUE(reader.ok()) << reader.status();
    {
      const auto store = *SqliteJobStore::Open(folder_ / "jobs.db");
      const auto ended =
          store->Finish(id, 1, ErrorOutcome(Job::FAILED, absl::InternalError("x")), absl::Now());
      ASSERT_TRUE(ended.ok()) << ended.status();
      if (!by_this_server) ASSERT_TRUE(store->Delete(id).ok());
    }
    if (by_this_server) EXPECT_TRUE(manager_->Delete(Everyone(), id).ok());
    FeedReader::Item item;
    Job last;
    EXPECT_TRUE(Eventually([&] {
      item = (*reader)->Next(absl::Now());
      if (item.frame && item.frame->has_job()) last = item.frame->job();
      return item.end.has_value();
    }));
    EXPECT_EQ(last.state(), by_this_server ? Job::FAILED : Job::RUNNING);
    EXPECT_EQ(item.end->ok(), by_this_server) << *item.end;
    reader->reset();  // before the manager that has counted it
    Stop(absl::ZeroDuration());
  }
}

TEST_F(JobManagerTest, StreamsThatATenantWatchesWithAreBoundedOverAllItsJobs) {
  options_.limits.max_tenant_watcher_count = 2;
  Start();
  const std::string first = Submit("succeed first;"), second = Submit("succeed second;");
  const auto watch = [&](const std::string& tenant, const std::string& id, int64_t after_seq = 0) {
    Caller caller = Everyone();
    caller.tenant.name = tenant;
    amhex::v1::WatchJobRequest request;
    request.set_name(JobName(id));
    request.set_after_seq(after_seq);
    return manager_->Watch(caller, request, std::make_shared<DeafListener>());
  };
  auto of_first = watch("ada", first);
  const auto of_second = watch("ada", second);
  ASSERT_TRUE(of_first.ok() && of_second.ok());
  for (const std::string& id : {first, second}) {
    EXPECT_EQ(ReasonOf(watch("ada", id).status()), "TOO_MANY_WATCHERS");
    EXPECT_TRUE(watch("bob", id).ok());
  }
  of_first->reset();
  // What is refused for another reason takes no place.
  EXPECT_EQ(ReasonOf(watch("ada", first, FrameCounter::kMaxForeignSeq).status()), "BAD_REQUEST");
  EXPECT_TRUE(watch("ada", second).ok());
}

TEST_F(JobManagerTest, MissingBlobIsRefusedWithItsName) {
  Start();
  amhex::v1::SubmitJobRequest request;
  request.mutable_input_blob()->set_sha256(std::string(64, 'a'));
  const auto refused = manager_->Submit(Everyone(), request);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ReasonOf(refused.status()), "BLOB_MISSING");
}

TEST_F(JobManagerTest, HostileInputIsRefusedBeforeAnyWorkerSeesIt) {
  Start();
  amhex::v1::SubmitJobRequest request;
  request.set_inline_input(DracoFileHeader(2, 3, 0, 1) + LittleEndian(2'147'483'647, 4) + '\1');
  EXPECT_EQ(ReasonOf(manager_->Submit(Everyone(), request).status()), "INPUT_TOO_LARGE");
}

TEST_F(JobManagerTest, EstimateComesFromAWorkerOfItsOwn) {
  Start();
  auto request = ScriptRequest("succeed mesh;");
  const auto input = manager_->AdmitInputOfEstimate(Everyone(), request);
  ASSERT_TRUE(input.ok());
  amhex::worker::RunJob order;
  order.set_input_path(manager_->PathOfBlob(input->blob.sha256()));
  const auto estimate = pool_->Estimate(order);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(estimate->cell_count(), 42);
}

TEST_F(JobManagerTest, OldestResultsGoWhenTheByteBudgetIsNearlySpent) {
  options_.limits.max_blob_store_bytes = 1900;
  Start();
  const std::string padding(399, 'x');
  std::string first;
  for (int i = 0; i < 2; ++i) {
    const std::string id = Submit("succeed " + std::to_string(i) + padding + ";");
    EXPECT_EQ(Finished(id).state(), Job::SUCCEEDED);
    if (i == 0) first = id;
  }
  const auto request = ScriptRequest("succeed 2" + padding + ";");
  EXPECT_EQ(ReasonOf(manager_->Submit(Everyone(), request).status()), "STORAGE_FULL");
  Stop(absl::ZeroDuration());
  options_.scarce_blob_age = absl::ZeroDuration();
  Start();  // collects at once
  EXPECT_TRUE(Eventually([&] { return !manager_->Get(Everyone(), first).ok(); }));
  EXPECT_TRUE(Eventually([&] { return manager_->Submit(Everyone(), request).ok(); }));
}

// Two jobs have left blobs that may go; a third one's do not fit beside them.
class NearlyFullStore : public JobManagerTest {
 protected:
  void SetUp() override {
    JobManagerTest::SetUp();
    options_.limits.max_blob_store_bytes = 1900;
    options_.scarce_blob_age = absl::ZeroDuration();
    Start();
    first_ = Submit("succeed 0" + padding_ + ";");
    EXPECT_EQ(Finished(first_).state(), Job::SUCCEEDED);
    EXPECT_EQ(Finished(Submit("succeed 1" + padding_ + ";")).state(), Job::SUCCEEDED);
  }
  const std::string padding_ = std::string(399, 'x');
  std::string first_;
};

TEST_F(NearlyFullStore, InputThatFindsNoRoomGetsThatOfOlderOnesAtOnce) {
  EXPECT_EQ(Finished(Submit("succeed 2" + padding_ + ";")).state(), Job::SUCCEEDED);
  EXPECT_TRUE(absl::IsNotFound(manager_->Get(Everyone(), first_).status()));
}

TEST_F(NearlyFullStore, UploadThatFindsNoRoomGetsThatOfOlderOnesAtOnce) {
  const std::string bytes(600, 'y');
  amhex::v1::BlobRef blob;
  blob.set_sha256(Sha256Hex(bytes));
  blob.set_size_bytes(static_cast<int64_t>(bytes.size()));
  auto upload = manager_->StartUpload(Everyone(), blob);
  ASSERT_TRUE(upload.ok()) << upload.status();
  ASSERT_TRUE((*upload)->Write(0, bytes.data(), bytes.size()).ok());
  EXPECT_TRUE(manager_->FinishUpload(Everyone(), blob, upload->get()).ok());
  EXPECT_TRUE(absl::IsNotFound(manager_->Get(Everyone(), first_).status()));
}

// Else whoever may upload could have all that others have thrown away, without a byte sent.
TEST_F(NearlyFullStore, RoomIsMadeForNothingThatIsBeyondTheTenantsQuota) {
  Caller greedy = Everyone();
  greedy.tenant.name = "greedy";
  greedy.tenant.max_blob_bytes = 500;
  amhex::v1::BlobRef blob;
  blob.set_sha256(Sha256Hex("whatever"));
  blob.set_size_bytes(1000);
  EXPECT_EQ(ReasonOf(manager_->StartUpload(greedy, blob).status()), "QUOTA_EXCEEDED");
  EXPECT_TRUE(manager_->Get(Everyone(), first_).ok());
}

TEST_F(JobManagerTest, ResultThatFindsNoRoomGetsThatOfOlderOnes) {
  options_.limits.max_blob_store_bytes = 1700;
  options_.scarce_blob_age = absl::ZeroDuration();
  Start();
  const std::string padding(399, 'x');
  const std::string first = Submit("succeed 1" + padding + ";");
  EXPECT_EQ(Finished(first).state(), Job::SUCCEEDED);
  const std::string second = Submit("succeed 2" + padding + ";");  // its input fits, no more does
  EXPECT_EQ(Finished(second).state(), Job::SUCCEEDED);
  EXPECT_TRUE(absl::IsNotFound(manager_->Get(Everyone(), first).status()));
}

}  // namespace
}  // namespace amhex::server
