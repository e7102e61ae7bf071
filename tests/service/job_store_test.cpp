// The laws of a durable queue; every implementation of JobStore must pass them.
#include "job_store.h"

#include <gtest/gtest.h>

#include "errors.h"
#include "job_id.h"
#include "service_fixtures.h"
#include "sqlite_job_store.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr absl::Duration kLease = absl::Seconds(30);
constexpr int64_t kManyJobs = 1000;

FinalOutcome Outcome(Job::State state) {
  FinalOutcome outcome;
  outcome.state = state;
  if (state == Job::SUCCEEDED) {
    outcome.details.mutable_result()->mutable_mesh()->set_sha256("result");
  } else {
    outcome.details.mutable_error()->set_code(1);
  }
  return outcome;
}

// The same store, opened as often as a test wants.
class JobStoreTest : public ::testing::Test {
 protected:
  void SetUp() override { Reopen(); }

  void Reopen() {
    store_.reset();
    auto opened = SqliteJobStore::Open(folder_ / "jobs.db");
    ASSERT_TRUE(opened.ok()) << opened.status();
    store_ = *std::move(opened);
  }

  NewJob Make(int priority = 50) {
    NewJob fresh;
    fresh.id = MakeUuid(now_);
    fresh.request_hash = "hash";
    fresh.ttl = absl::Hours(1);
    fresh.job.set_priority(priority);
    fresh.job.set_max_attempts(2);
    fresh.job.mutable_input()->set_sha256("input");
    return fresh;
  }

  // Submits and returns the id.
  std::string Submit(const NewJob& job) {
    const auto submitted = store_->Submit(job, kManyJobs, now_);
    EXPECT_TRUE(submitted.ok()) << submitted.status();
    return job.id;
  }

  ClaimedJob Claim() {
    auto claimed = store_->Claim("worker", now_, kLease);
    EXPECT_TRUE(claimed.ok() && claimed->has_value());
    return claimed.ok() && claimed->has_value() ? **claimed : ClaimedJob();
  }

  bool NothingToClaim() {
    const auto claimed = store_->Claim("worker", now_, kLease);
    return claimed.ok() && !claimed->has_value();
  }

  Job::State StateOf(const std::string& id) {
    const auto job = store_->Get(id);
    return job.ok() ? job->state() : Job::STATE_UNSPECIFIED;
  }

  TemporaryFolder folder_;
  absl::Time now_ = absl::FromUnixSeconds(1'700'000'000);
  std::unique_ptr<JobStore> store_;
};

TEST_F(JobStoreTest, EmptyQueueHasNothingToClaim) { EXPECT_TRUE(NothingToClaim()); }

TEST_F(JobStoreTest, SubmittedJobSurvivesReopening) {
  const std::string id = Submit(Make());
  Reopen();
  EXPECT_EQ(StateOf(id), Job::QUEUED);
  EXPECT_EQ(Claim().id, id);
}

TEST_F(JobStoreTest, SameRequestIdGivesTheSameJob) {
  NewJob first = Make();
  first.request_id = "request";
  NewJob second = Make();
  second.request_id = "request";
  Submit(first);
  const auto again = store_->Submit(second, kManyJobs, now_);
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(again->is_new);
  EXPECT_EQ(again->job.name(), JobName(first.id));
}

TEST_F(JobStoreTest, SameRequestIdForAnotherRequestIsRefused) {
  NewJob first = Make();
  first.request_id = "request";
  NewJob second = Make();
  second.request_id = "request";
  second.request_hash = "other";
  Submit(first);
  const auto refused = store_->Submit(second, kManyJobs, now_);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(ReasonOf(refused.status()), "REQUEST_ID_REUSED");
}

TEST_F(JobStoreTest, FullQueueRefusesNewJobsButKnowsOldOnes) {
  NewJob first = Make();
  first.request_id = "request";
  Submit(first);
  const auto refused = store_->Submit(Make(), 1, now_);
  EXPECT_EQ(ReasonOf(refused.status()), "QUEUE_FULL");
  EXPECT_TRUE(store_->Submit(first, 1, now_).ok());
}

TEST_F(JobStoreTest, ClaimsInOrderOfPriorityThenSubmission) {
  const std::string late = Submit(Make(60));
  const std::string first = Submit(Make(50));
  const std::string second = Submit(Make(50));
  const std::string urgent = Submit(Make(1));
  for (const std::string& id : {urgent, first, second, late}) EXPECT_EQ(Claim().id, id);
}

TEST_F(JobStoreTest, ClaimedJobIsNotClaimedTwice) {
  Submit(Make());
  Claim();
  EXPECT_TRUE(NothingToClaim());
}

TEST_F(JobStoreTest, FinishRecordsTheOutcomeAndTheExpiry) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Finish(id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  const auto job = store_->Get(id);
  ASSERT_TRUE(job.ok());
  EXPECT_EQ(job->state(), Job::SUCCEEDED);
  EXPECT_EQ(job->result().mesh().sha256(), "result");
  EXPECT_EQ(job->expire_time().seconds(), absl::ToUnixSeconds(now_ + absl::Hours(1)));
  EXPECT_EQ(job->attempt_count(), 1);
}

TEST_F(JobStoreTest, SecondFinishOfAnAttemptIsFenced) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Finish(id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  EXPECT_TRUE(absl::IsAborted(store_->Finish(id, claimed.epoch, Outcome(Job::FAILED), now_)));
  EXPECT_EQ(StateOf(id), Job::SUCCEEDED);
}

TEST_F(JobStoreTest, HolderOfAnExpiredLeaseIsFencedByTheNextClaim) {
  const std::string id = Submit(Make());
  const ClaimedJob slow = Claim();
  now_ += kLease + absl::Seconds(1);
  ASSERT_TRUE(store_->ReapExpiredLeases(now_).ok());
  const ClaimedJob quick = Claim();
  EXPECT_EQ(quick.id, id);
  EXPECT_GT(quick.epoch, slow.epoch);
  EXPECT_TRUE(absl::IsAborted(store_->Heartbeat(id, slow.epoch, now_, kLease).status()));
  EXPECT_TRUE(absl::IsAborted(store_->Finish(id, slow.epoch, Outcome(Job::SUCCEEDED), now_)));
  EXPECT_TRUE(absl::IsAborted(store_->Release(id, slow.epoch, ReleaseMode::kSpendAttempt, now_)));
  EXPECT_TRUE(store_->Finish(id, quick.epoch, Outcome(Job::SUCCEEDED), now_).ok());
}

TEST_F(JobStoreTest, HeartbeatKeepsTheLease) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  now_ += kLease - absl::Seconds(1);
  ASSERT_TRUE(store_->Heartbeat(id, claimed.epoch, now_, kLease).ok());
  now_ += kLease - absl::Seconds(1);
  ASSERT_TRUE(store_->ReapExpiredLeases(now_).ok());
  EXPECT_EQ(StateOf(id), Job::RUNNING);
}

TEST_F(JobStoreTest, ExpiredLeaseOfTheLastAttemptIsReportedAsExhausted) {
  const std::string id = Submit(Make());
  for (int attempt = 0; attempt < 2; ++attempt) {
    Claim();
    now_ += kLease + absl::Seconds(1);
    const auto exhausted = store_->ReapExpiredLeases(now_);
    ASSERT_TRUE(exhausted.ok());
    EXPECT_EQ(exhausted->size(), attempt == 1 ? 1u : 0u);
  }
  EXPECT_EQ(StateOf(id), Job::RUNNING);
}

TEST_F(JobStoreTest, ReleaseSpendsOrGivesBackTheAttempt) {
  const std::string id = Submit(Make());
  ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Release(id, claimed.epoch, ReleaseMode::kSpendAttempt, now_).ok());
  EXPECT_EQ(store_->Get(id)->attempt_count(), 1);
  claimed = Claim();
  EXPECT_EQ(claimed.job.attempt_count(), 2);
  ASSERT_TRUE(store_->Release(id, claimed.epoch, ReleaseMode::kGiveAttemptBack, now_).ok());
  EXPECT_EQ(store_->Get(id)->attempt_count(), 1);
}

TEST_F(JobStoreTest, ReleasedJobWaitsUntilItsTime) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  const absl::Time later = now_ + absl::Seconds(10);
  ASSERT_TRUE(store_->Release(id, claimed.epoch, ReleaseMode::kSpendAttempt, later).ok());
  EXPECT_TRUE(NothingToClaim());
  now_ = later;
  EXPECT_EQ(Claim().id, id);
}

TEST_F(JobStoreTest, RestartRequeuesRunningJobsWithTheAttemptGivenBackAndFencesTheOldHolder) {
  const std::string id = Submit(Make());
  const ClaimedJob before = Claim();
  Reopen();
  const auto requeued = store_->RequeueRunning();
  ASSERT_TRUE(requeued.ok());
  EXPECT_EQ(*requeued, 1);
  EXPECT_EQ(StateOf(id), Job::QUEUED);
  EXPECT_EQ(store_->Get(id)->attempt_count(), 0);
  EXPECT_TRUE(absl::IsAborted(store_->Finish(id, before.epoch, Outcome(Job::SUCCEEDED), now_)));
  EXPECT_EQ(Claim().id, id);
}

TEST_F(JobStoreTest, CancelEndsAQueuedJobAtOnce) {
  const std::string id = Submit(Make());
  const auto job = store_->RequestCancel(id, Outcome(Job::CANCELLED), now_);
  ASSERT_TRUE(job.ok());
  EXPECT_EQ(job->state(), Job::CANCELLED);
  EXPECT_TRUE(NothingToClaim());
}

TEST_F(JobStoreTest, CancelOfARunningJobReachesItsHolderByHeartbeat) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  const auto job = store_->RequestCancel(id, Outcome(Job::CANCELLED), now_);
  ASSERT_TRUE(job.ok());
  EXPECT_EQ(job->state(), Job::RUNNING);
  EXPECT_TRUE(job->cancel_requested());
  const auto cancel = store_->Heartbeat(id, claimed.epoch, now_, kLease);
  EXPECT_TRUE(cancel.ok() && *cancel);
}

TEST_F(JobStoreTest, CancelLeavesFinalJobsAsTheyAre) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Finish(id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  ASSERT_TRUE(store_->RequestCancel(id, Outcome(Job::CANCELLED), now_).ok());
  EXPECT_EQ(StateOf(id), Job::SUCCEEDED);
  EXPECT_FALSE(store_->Get(id)->cancel_requested());
}

TEST_F(JobStoreTest, DeleteRemovesFinalJobsOnly) {
  const std::string id = Submit(Make());
  EXPECT_EQ(ReasonOf(store_->Delete(id)), "JOB_NOT_FINAL");
  ASSERT_TRUE(store_->RequestCancel(id, Outcome(Job::CANCELLED), now_).ok());
  EXPECT_TRUE(store_->Delete(id).ok());
  EXPECT_EQ(ReasonOf(store_->Delete(id)), "JOB_NOT_FOUND");
  EXPECT_EQ(ReasonOf(store_->Get(id).status()), "JOB_NOT_FOUND");
}

TEST_F(JobStoreTest, QueuedJobPastItsDeadlineIsEndedAndNeverClaimed) {
  NewJob job = Make();
  job.job.mutable_queue_timeout()->set_seconds(5);
  Submit(job);
  now_ += absl::Seconds(6);
  EXPECT_TRUE(NothingToClaim());
  const auto ended = store_->ExpireQueued(Outcome(Job::FAILED), now_);
  ASSERT_TRUE(ended.ok());
  ASSERT_EQ(ended->size(), 1u);
  EXPECT_EQ(StateOf(job.id), Job::FAILED);
}

TEST_F(JobStoreTest, FinalJobsAreRemovedAfterTheirTime) {
  const std::string id = Submit(Make());
  ASSERT_TRUE(store_->RequestCancel(id, Outcome(Job::CANCELLED), now_).ok());
  EXPECT_TRUE(store_->RemoveExpired(now_ + absl::Minutes(59))->empty());
  EXPECT_EQ(store_->RemoveExpired(now_ + absl::Minutes(61))->size(), 1u);
  EXPECT_EQ(ReasonOf(store_->Get(id).status()), "JOB_NOT_FOUND");
}

TEST_F(JobStoreTest, PagesListEveryJobOnceNewestFirst) {
  std::vector<std::string> ids;
  for (int i = 0; i < 7; ++i) ids.push_back(Submit(Make()));
  JobQuery query;
  query.page_size = 3;
  std::vector<std::string> listed;
  do {
    const auto page = store_->List(query);
    ASSERT_TRUE(page.ok());
    for (const Job& job : page->jobs) listed.push_back(JobIdFromName(job.name()));
    query.before_number = page->next_before_number;
  } while (query.before_number != 0);
  std::reverse(ids.begin(), ids.end());
  EXPECT_EQ(listed, ids);
}

TEST_F(JobStoreTest, ListKeepsOnlyMatchingStatesAndLabels) {
  NewJob red = Make();
  (*red.job.mutable_labels())["colour"] = "red";
  Submit(red);
  Submit(Make());
  JobQuery query;
  query.page_size = 10;
  query.labels = {{"colour", "red"}};
  EXPECT_EQ(store_->List(query)->jobs.size(), 1u);
  query.states = {Job::RUNNING};
  EXPECT_TRUE(store_->List(query)->jobs.empty());
}

TEST_F(JobStoreTest, BlobsAreUsedAsLongAsAJobNamesThem) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  EXPECT_TRUE(*store_->IsBlobUsed("input"));
  EXPECT_FALSE(*store_->IsBlobUsed("result"));
  ASSERT_TRUE(store_->Finish(id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  EXPECT_TRUE(*store_->IsBlobUsed("result"));
  ASSERT_TRUE(store_->Delete(id).ok());
  EXPECT_FALSE(*store_->IsBlobUsed("input"));
  EXPECT_FALSE(*store_->IsBlobUsed("result"));
}

TEST_F(JobStoreTest, GenerationGrowsWithEveryOpening) {
  const int64_t first = *store_->NextGeneration();
  Reopen();
  EXPECT_GT(*store_->NextGeneration(), first);
}

}  // namespace
}  // namespace amhex::server
