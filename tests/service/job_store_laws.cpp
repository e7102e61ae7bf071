// The laws of a durable queue; see job_store_laws.h.
#include "job_store_laws.h"

#include <algorithm>
#include <map>
#include <set>

#include "errors.h"
#include "job_id.h"
#include "job_record.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

TEST_P(JobStoreLaws, EmptyQueueHasNothingToClaim) { EXPECT_TRUE(NothingToClaim()); }

TEST_P(JobStoreLaws, SubmittedJobSurvivesReopening) {
  const std::string id = Submit(Make());
  Reopen();
  EXPECT_EQ(StateOf(id), Job::QUEUED);
  EXPECT_EQ(Claim().id, id);
}

TEST_P(JobStoreLaws, SameRequestIdGivesTheSameJob) {
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

TEST_P(JobStoreLaws, SameRequestIdForAnotherRequestIsRefused) {
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

TEST_P(JobStoreLaws, FullQueueRefusesNewJobsButKnowsOldOnes) {
  NewJob first = Make();
  first.request_id = "request";
  Submit(first);
  const auto refused = store_->Submit(Make(), 1, now_);
  EXPECT_EQ(ReasonOf(refused.status()), "QUEUE_FULL");
  EXPECT_TRUE(store_->Submit(first, 1, now_).ok());
}

TEST_P(JobStoreLaws, ClaimsInOrderOfPriorityThenSubmission) {
  const std::string late = Submit(Make(60));
  const std::string first = Submit(Make(50));
  const std::string second = Submit(Make(50));
  const std::string urgent = Submit(Make(1));
  for (const std::string& id : {urgent, first, second, late}) EXPECT_EQ(Claim().id, id);
}

TEST_P(JobStoreLaws, ClaimedJobIsNotClaimedTwice) {
  Submit(Make());
  Claim();
  EXPECT_TRUE(NothingToClaim());
}

TEST_P(JobStoreLaws, FinishRecordsTheOutcomeAndTheExpiry) {
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

TEST_P(JobStoreLaws, SecondFinishOfAnAttemptIsFenced) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Finish(id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  EXPECT_TRUE(
      absl::IsAborted(store_->Finish(id, claimed.epoch, Outcome(Job::FAILED), now_).status()));
  EXPECT_EQ(StateOf(id), Job::SUCCEEDED);
}

TEST_P(JobStoreLaws, HolderOfAnExpiredLeaseIsFencedByTheNextClaim) {
  const std::string id = Submit(Make());
  const ClaimedJob slow = Claim();
  now_ += kLease + absl::Seconds(1);
  ASSERT_TRUE(store_->ReapExpiredLeases(now_).ok());
  const ClaimedJob quick = Claim();
  EXPECT_EQ(quick.id, id);
  EXPECT_GT(quick.epoch, slow.epoch);
  EXPECT_TRUE(absl::IsAborted(store_->Heartbeat(id, slow.epoch, now_, kLease).status()));
  EXPECT_TRUE(
      absl::IsAborted(store_->Finish(id, slow.epoch, Outcome(Job::SUCCEEDED), now_).status()));
  EXPECT_TRUE(
      absl::IsAborted(store_->Release(id, slow.epoch, ReleaseMode::kSpendAttempt, now_, now_)));
  EXPECT_TRUE(store_->Finish(id, quick.epoch, Outcome(Job::SUCCEEDED), now_).ok());
}

TEST_P(JobStoreLaws, HeartbeatKeepsTheLease) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  now_ += kLease - absl::Seconds(1);
  ASSERT_TRUE(store_->Heartbeat(id, claimed.epoch, now_, kLease).ok());
  now_ += kLease - absl::Seconds(1);
  ASSERT_TRUE(store_->ReapExpiredLeases(now_).ok());
  EXPECT_EQ(StateOf(id), Job::RUNNING);
}

TEST_P(JobStoreLaws, ExpiredLeaseOfTheLastAttemptIsReportedAsExhausted) {
  const std::string id = Submit(Make());
  for (int attempt = 0; attempt < 2; ++attempt) {
    Claim();
    now_ += kLease + absl::Seconds(1);
    const auto reaped = store_->ReapExpiredLeases(now_);
    ASSERT_TRUE(reaped.ok());
    EXPECT_EQ(reaped->exhausted.size(), attempt == 1 ? 1u : 0u);
    EXPECT_EQ(reaped->requeued.size(), attempt == 1 ? 0u : 1u);
  }
  EXPECT_EQ(StateOf(id), Job::RUNNING);
}

TEST_P(JobStoreLaws, ReleaseSpendsOrGivesBackTheAttempt) {
  const std::string id = Submit(Make());
  ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Release(id, claimed.epoch, ReleaseMode::kSpendAttempt, now_, now_).ok());
  EXPECT_EQ(store_->Get(id)->attempt_count(), 1);
  claimed = Claim();
  EXPECT_EQ(claimed.job.attempt_count(), 2);
  ASSERT_TRUE(store_->Release(id, claimed.epoch, ReleaseMode::kGiveAttemptBack, now_, now_).ok());
  EXPECT_EQ(store_->Get(id)->attempt_count(), 1);
}

TEST_P(JobStoreLaws, ClockThatIsSetBackHoldsNoQueuedJobUp) {
  Submit(Make());
  now_ -= absl::Hours(5);
  const ClaimedJob claimed = Claim();
  now_ += absl::Hours(5);
  ASSERT_TRUE(store_
                  ->Release(claimed.id, claimed.epoch, ReleaseMode::kSpendAttempt, now_,
                            now_ + kLongestDelay)
                  .ok());
  EXPECT_TRUE(NothingToClaim());
  now_ -= absl::Seconds(1);
  Claim();
}

TEST_P(JobStoreLaws, ReleasedJobWaitsUntilItsTime) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  const absl::Time later = now_ + absl::Seconds(10);
  ASSERT_TRUE(store_->Release(id, claimed.epoch, ReleaseMode::kSpendAttempt, now_, later).ok());
  EXPECT_TRUE(NothingToClaim());
  now_ = later;
  EXPECT_EQ(Claim().id, id);
}

TEST_P(JobStoreLaws, RestartRequeuesRunningJobsWithTheAttemptGivenBackAndFencesTheOldHolder) {
  const std::string id = Submit(Make());
  const ClaimedJob before = Claim();
  Reopen();
  const auto requeued = store_->RequeueRunning(kNode);
  ASSERT_TRUE(requeued.ok());
  EXPECT_EQ(*requeued, 1);
  EXPECT_EQ(StateOf(id), Job::QUEUED);
  EXPECT_EQ(store_->Get(id)->attempt_count(), 0);
  EXPECT_TRUE(
      absl::IsAborted(store_->Finish(id, before.epoch, Outcome(Job::SUCCEEDED), now_).status()));
  EXPECT_EQ(Claim().id, id);
}

TEST_P(JobStoreLaws, CancelEndsAQueuedJobAtOnce) {
  const std::string id = Submit(Make());
  const auto job = store_->RequestCancel(id, Outcome(Job::CANCELLED), now_);
  ASSERT_TRUE(job.ok());
  EXPECT_EQ(job->state(), Job::CANCELLED);
  EXPECT_TRUE(NothingToClaim());
}

TEST_P(JobStoreLaws, CancelOfARunningJobReachesItsHolderByHeartbeat) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  const auto job = store_->RequestCancel(id, Outcome(Job::CANCELLED), now_);
  ASSERT_TRUE(job.ok());
  EXPECT_EQ(job->state(), Job::RUNNING);
  EXPECT_TRUE(job->cancel_requested());
  const auto cancel = store_->Heartbeat(id, claimed.epoch, now_, kLease);
  EXPECT_TRUE(cancel.ok() && *cancel);
}

// Else it would wait behind all others before it is ended, and be begun for that.
TEST_P(JobStoreLaws, JobToBeCancelledNeverGoesBackToTheQueue) {
  std::vector<ClaimedJob> jobs;
  for (int i = 0; i < 3; ++i) {
    Submit(Make());
    jobs.push_back(Claim());
    ASSERT_TRUE(store_->RequestCancel(jobs[i].id, Outcome(Job::CANCELLED), now_).ok());
  }
  for (const auto mode : {ReleaseMode::kSpendAttempt, ReleaseMode::kGiveAttemptBack}) {
    EXPECT_TRUE(absl::IsCancelled(store_->Release(jobs[0].id, jobs[0].epoch, mode, now_, now_)));
    EXPECT_TRUE(absl::IsAborted(store_->Release(jobs[0].id, jobs[0].epoch - 1, mode, now_, now_)));
  }
  EXPECT_TRUE(store_->Finish(jobs[0].id, jobs[0].epoch, Outcome(Job::CANCELLED), now_).ok());
  EXPECT_TRUE(store_->ReapExpiredLeases(now_)->cancelled.empty());
  // Neither when its node starts again, nor when its lease ends.
  const auto requeued = store_->RequeueRunning(kNode);
  EXPECT_TRUE(requeued.ok() && *requeued == 0);
  EXPECT_TRUE(NothingToClaim());
  EXPECT_TRUE(absl::IsAborted(store_->Heartbeat(jobs[1].id, jobs[1].epoch, now_, kLease).status()));
  const auto reaped = store_->ReapExpiredLeases(now_);
  ASSERT_TRUE(reaped.ok()) << reaped.status();
  EXPECT_TRUE(reaped->requeued.empty() && reaped->exhausted.empty());
  ASSERT_EQ(reaped->cancelled.size(), 2U);
  for (const ClaimedJob& job : reaped->cancelled) {
    EXPECT_TRUE(store_->Finish(job.id, job.epoch, Outcome(Job::CANCELLED), now_).ok());
    EXPECT_EQ(StateOf(job.id), Job::CANCELLED);
  }
}

TEST_P(JobStoreLaws, CancelLeavesFinalJobsAsTheyAre) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Finish(id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  ASSERT_TRUE(store_->RequestCancel(id, Outcome(Job::CANCELLED), now_).ok());
  EXPECT_EQ(StateOf(id), Job::SUCCEEDED);
  EXPECT_FALSE(store_->Get(id)->cancel_requested());
}

TEST_P(JobStoreLaws, DeleteRemovesFinalJobsOnly) {
  const std::string id = Submit(Make());
  EXPECT_EQ(ReasonOf(store_->Delete(id)), "JOB_NOT_FINAL");
  ASSERT_TRUE(store_->RequestCancel(id, Outcome(Job::CANCELLED), now_).ok());
  EXPECT_TRUE(store_->Delete(id).ok());
  EXPECT_EQ(ReasonOf(store_->Delete(id)), "JOB_NOT_FOUND");
  EXPECT_EQ(ReasonOf(store_->Get(id).status()), "JOB_NOT_FOUND");
}

TEST_P(JobStoreLaws, QueuedJobPastItsDeadlineIsEndedAndNeverClaimed) {
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

TEST_P(JobStoreLaws, FinalJobsAreRemovedAfterTheirTime) {
  const std::string id = Submit(Make());
  ASSERT_TRUE(store_->RequestCancel(id, Outcome(Job::CANCELLED), now_).ok());
  EXPECT_TRUE(store_->RemoveExpired(now_ + absl::Minutes(59))->empty());
  EXPECT_EQ(store_->RemoveExpired(now_ + absl::Minutes(61))->size(), 1u);
  EXPECT_EQ(ReasonOf(store_->Get(id).status()), "JOB_NOT_FOUND");
}

TEST_P(JobStoreLaws, PagesListEveryJobOnceNewestFirst) {
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

TEST_P(JobStoreLaws, PagesEndWhereTheirBytesDoAndHaveOneJobAtLeast) {
  for (int i = 0; i < 5; ++i) {
    NewJob large = Make();
    (*large.job.mutable_labels())["note"] = std::string(1000, 'x');
    Submit(large);
  }
  JobQuery query;
  query.page_size = 10;
  for (const auto& [bytes, jobs] : std::map<int64_t, size_t>{{10, 1}, {2999, 2}, {10000, 5}}) {
    query.page_bytes = bytes;
    query.before_number = 0;
    std::set<std::string> listed;
    do {
      const auto page = store_->List(query);
      ASSERT_TRUE(page.ok());
      EXPECT_EQ(page->jobs.size(), std::min(jobs, 5 - listed.size())) << bytes;
      for (const Job& job : page->jobs) EXPECT_TRUE(listed.insert(job.name()).second);
      query.before_number = page->next_before_number;
    } while (query.before_number != 0);
    EXPECT_EQ(listed.size(), 5u) << bytes;
  }
}

TEST_P(JobStoreLaws, ListFindsAJobBehindManyThatDoNotMatch) {
  NewJob red = Make();
  (*red.job.mutable_labels())["colour"] = "red";
  const std::string id = Submit(red);
  for (int i = 0; i < kListRows; ++i) {
    ASSERT_TRUE(store_->Submit(Make(), 2 * kListRows, now_).ok());
  }
  JobQuery query;
  query.page_size = 1;
  query.labels = {{"colour", "red"}};
  const auto page = store_->List(query);
  ASSERT_TRUE(page.ok());
  ASSERT_EQ(page->jobs.size(), 1u);
  EXPECT_EQ(page->jobs[0].name(), JobName(id));
  EXPECT_EQ(page->next_before_number, 0);
}

TEST_P(JobStoreLaws, ListKeepsOnlyMatchingStatesAndLabels) {
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

TEST_P(JobStoreLaws, BlobsAreUsedAsLongAsAJobNamesThemOrATenantHasThemStill) {
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  EXPECT_TRUE(IsUsed("input"));
  EXPECT_FALSE(IsUsed("result"));
  ASSERT_TRUE(store_->Finish(id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  EXPECT_TRUE(IsUsed("result"));
  EXPECT_EQ(*store_->DropUnusedGrants(now_ + absl::Seconds(1)), 0);
  ASSERT_TRUE(store_->Delete(id).ok());
  EXPECT_TRUE(IsUsed("input"));
  EXPECT_EQ(*store_->DropUnusedGrants(now_ + absl::Seconds(1)), 2);
  EXPECT_FALSE(IsUsed("input"));
  EXPECT_FALSE(IsUsed("result"));
}

TEST_P(JobStoreLaws, OldestFinalJobsAreRemovedFirst) {
  std::vector<std::string> ids;
  for (int i = 0; i < 3; ++i) {
    ids.push_back(Submit(Make()));
    ASSERT_TRUE(store_->RequestCancel(ids.back(), Outcome(Job::CANCELLED), now_).ok());
    now_ += absl::Minutes(1);
  }
  const std::string queued = Submit(Make());
  EXPECT_EQ(*store_->RemoveOldestFinal(1, now_), std::vector<std::string>{ids[0]});
  EXPECT_EQ(store_->RemoveOldestFinal(5, now_ - absl::Minutes(1))->size(), 1u);
  EXPECT_EQ(StateOf(ids[2]), Job::CANCELLED);
  EXPECT_EQ(StateOf(queued), Job::QUEUED);
}

TEST_P(JobStoreLaws, GenerationGrowsWithEveryOpening) {
  const int64_t first = *store_->NextGeneration();
  Reopen();
  EXPECT_GT(*store_->NextGeneration(), first);
}

}  // namespace
}  // namespace amhex::server
