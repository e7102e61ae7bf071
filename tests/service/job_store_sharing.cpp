// The laws of a queue that several tenants share: who sees what, whose turn it is, what fits, whose
// result serves whom. See job_store_laws.h.
#include <atomic>
#include <map>
#include <set>
#include <thread>

#include "absl/time/clock.h"
#include "errors.h"
#include "job_id.h"
#include "job_store_laws.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

amhex::v1::BlobRef Blob(const std::string& sha256, int64_t size_bytes) {
  amhex::v1::BlobRef blob;
  blob.set_sha256(sha256);
  blob.set_size_bytes(size_bytes);
  return blob;
}

TEST_P(JobStoreLaws, JobTellsItsTenant) {
  const std::string id = Submit(MakeFor("ada"));
  EXPECT_EQ(store_->Get(id)->tenant(), "ada");
  EXPECT_EQ(Claim().job.tenant(), "ada");
}

TEST_P(JobStoreLaws, RequestIdsOfTenantsAreApart) {
  NewJob first = MakeFor("ada");
  first.request_id = "request";
  NewJob second = MakeFor("bob");
  second.request_id = "request";
  second.request_hash = "other";
  Submit(first);
  const auto submitted = store_->Submit(second, kManyJobs, now_);
  ASSERT_TRUE(submitted.ok()) << submitted.status();
  EXPECT_TRUE(submitted->is_new);
}

TEST_P(JobStoreLaws, ListKeepsToTheTenantAsked) {
  Submit(MakeFor("ada"));
  Submit(MakeFor("bob"));
  Submit(MakeFor("ada"));
  JobQuery query;
  query.page_size = 1;
  query.tenant = "ada";
  int count = 0;
  do {
    const auto page = store_->List(query);
    ASSERT_TRUE(page.ok());
    for (const Job& job : page->jobs) {
      EXPECT_EQ(job.tenant(), "ada");
      ++count;
    }
    query.before_number = page->next_before_number;
  } while (query.before_number != 0);
  EXPECT_EQ(count, 2);
}

TEST_P(JobStoreLaws, TenantBeyondItsQueueQuotaIsRefusedAndOthersAreNot) {
  NewJob first = MakeFor("ada");
  first.tenant.max_queued_jobs = 1;
  Submit(first);
  NewJob second = MakeFor("ada");
  second.tenant.max_queued_jobs = 1;
  EXPECT_EQ(ReasonOf(store_->Submit(second, kManyJobs, now_).status()), "QUOTA_EXCEEDED");
  Submit(MakeFor("bob"));
  EXPECT_EQ(Claim().id, first.id);
  Submit(second);
}

TEST_P(JobStoreLaws, TenantRunsNoMoreJobsThanItsQuota) {
  for (int i = 0; i < 3; ++i) {
    NewJob job = MakeFor("ada");
    job.tenant.max_running_jobs = 2;
    Submit(job);
  }
  const ClaimedJob first = Claim();
  Claim();
  EXPECT_TRUE(NothingToClaim());
  ASSERT_TRUE(store_->Finish(first.id, first.epoch, Outcome(Job::FAILED), now_).ok());
  Claim();
}

TEST_P(JobStoreLaws, AFloodOfOneTenantDelaysAnotherByOneJobAtMost) {
  for (int i = 0; i < 20; ++i) Submit(MakeFor("flood"));
  EXPECT_EQ(RunNext(absl::Minutes(1)), "flood");
  Submit(MakeFor("single"));
  const std::string next = RunNext(absl::Minutes(1));
  EXPECT_EQ(next == "flood" ? RunNext(absl::Minutes(1)) : next, "single");
}

TEST_P(JobStoreLaws, TenantsGetEqualTimeWhateverTheLengthOfTheirJobs) {
  for (int i = 0; i < 100; ++i) Submit(MakeFor("short"));
  for (int i = 0; i < 100; ++i) Submit(MakeFor("long"));
  std::map<std::string, absl::Duration> served;
  for (int i = 0; i < 50; ++i) {
    const ClaimedJob claimed = Claim();
    const absl::Duration span = absl::Minutes(claimed.job.tenant() == "long" ? 10 : 1);
    now_ += span;
    served[claimed.job.tenant()] += span;
    ASSERT_TRUE(store_->Finish(claimed.id, claimed.epoch, Outcome(Job::FAILED), now_).ok());
  }
  EXPECT_LE(absl::AbsDuration(served["short"] - served["long"]), absl::Minutes(10));
}

TEST_P(JobStoreLaws, WeightsDivideTheTime) {
  for (int i = 0; i < 40; ++i) {
    NewJob heavy = MakeFor("heavy");
    heavy.tenant.weight = 3;
    Submit(heavy);
    Submit(MakeFor("light"));
  }
  std::map<std::string, int> count;
  for (int i = 0; i < 40; ++i) ++count[RunNext(absl::Minutes(1))];
  EXPECT_NEAR(count["heavy"], 30, 2);
}

TEST_P(JobStoreLaws, WorkersThatAskAtOnceServeSeveralTenants) {
  for (int i = 0; i < 3; ++i) Submit(MakeFor("ada"));
  for (int i = 0; i < 3; ++i) Submit(MakeFor("bob"));
  std::map<std::string, int> count;
  for (int i = 0; i < 4; ++i) ++count[Claim().job.tenant()];
  EXPECT_EQ(count["ada"], 2);
  EXPECT_EQ(count["bob"], 2);
}

TEST_P(JobStoreLaws, IdleTenantSavesNothingUp) {
  Submit(MakeFor("idle"));
  RunNext(absl::Seconds(1));
  for (int i = 0; i < 40; ++i) Submit(MakeFor("busy"));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(RunNext(absl::Minutes(1)), "busy");
  for (int i = 0; i < 20; ++i) Submit(MakeFor("idle"));
  std::map<std::string, int> count;
  for (int i = 0; i < 10; ++i) ++count[RunNext(absl::Minutes(1))];
  EXPECT_NEAR(count["idle"], 5, 1);
}

TEST_P(JobStoreLaws, PriorityOvertakesWithinATenantOnly) {
  NewJob urgent = MakeFor("bob");
  urgent.job.set_priority(0);
  const std::string first = Submit(MakeFor("ada"));
  Submit(MakeFor("bob"));
  Submit(urgent);
  EXPECT_EQ(Claim().id, first);
  EXPECT_EQ(Claim().id, urgent.id);
}

TEST_P(JobStoreLaws, WaitingMakesUpForPriority) {
  const std::string patient = Submit(Make(100));
  now_ += 99 * kPriorityStep;
  const std::string early = Submit(Make(0));
  now_ += 2 * kPriorityStep;
  const std::string late = Submit(Make(0));
  EXPECT_EQ(Claim().id, early);
  EXPECT_EQ(Claim().id, patient);
  EXPECT_EQ(Claim().id, late);
}

TEST_P(JobStoreLaws, JobsLargerThanTheClaimantAreLeftForOthers) {
  NewJob large = Make();
  large.cost.memory_bytes = 1000;
  Submit(large);
  const std::string small = Submit(Make());
  Claimant claimant = AnyJob();
  claimant.total_memory_bytes = claimant.free_memory_bytes = 999;
  now_ += absl::Hours(1);
  EXPECT_EQ(Claim(claimant).id, small);
  EXPECT_TRUE(NothingToClaim(claimant));
  EXPECT_EQ(Claim().id, large.id);
}

TEST_P(JobStoreLaws, CostOfTheQueueIsThatOfTheJobsThatWait) {
  EXPECT_EQ(*store_->QueuedCost(), absl::ZeroDuration());
  NewJob first = Make(), second = Make();
  first.cost.duration = absl::Seconds(2.5);
  second.cost.duration = absl::Hours(3);
  Submit(first);
  Submit(second);
  Reopen();
  EXPECT_EQ(*store_->QueuedCost(), absl::Seconds(2.5) + absl::Hours(3));
  const ClaimedJob claimed = Claim();
  ASSERT_EQ(claimed.id, first.id);
  EXPECT_EQ(*store_->QueuedCost(), absl::Hours(3));
  ASSERT_TRUE(
      store_->Release(claimed.id, claimed.epoch, ReleaseMode::kGiveAttemptBack, now_, now_).ok());
  EXPECT_EQ(*store_->QueuedCost(), absl::Seconds(2.5) + absl::Hours(3));
}

TEST_P(JobStoreLaws, SmallJobsOvertakeOneThatDoesNotFitNowButNotForEver) {
  NewJob large = Make();
  large.cost.memory_bytes = 1000;
  Submit(large);
  NewJob small = Make();
  small.cost.memory_bytes = 100;
  Submit(small);
  NewJob other = Make();
  other.cost.memory_bytes = 100;
  Submit(other);
  Claimant claimant = AnyJob();
  claimant.total_memory_bytes = 1000;
  claimant.free_memory_bytes = 500;
  EXPECT_EQ(Claim(claimant).id, small.id);
  now_ += claimant.max_overtaking + absl::Seconds(1);
  EXPECT_TRUE(NothingToClaim(claimant));
  claimant.free_memory_bytes = 1000;
  EXPECT_EQ(Claim(claimant).id, large.id);
}

TEST_P(JobStoreLaws, EndOfOneTwinIsNotThatOfTheOther) {
  std::vector<std::string> twins;
  for (int i = 0; i < 3; ++i) {
    NewJob job = Make();
    job.cache_key = "key";
    twins.push_back(Submit(job));
  }
  const ClaimedJob first = Claim();
  ASSERT_EQ(first.id, twins[0]);
  ASSERT_TRUE(store_->RequestCancel(first.id, Outcome(Job::CANCELLED), now_).ok());
  ASSERT_TRUE(store_->Finish(first.id, first.epoch, Outcome(Job::CANCELLED), now_).ok());
  const ClaimedJob second = Claim();  // in its place
  ASSERT_EQ(second.id, twins[1]);
  ASSERT_TRUE(store_->RequestCancel(twins[2], Outcome(Job::CANCELLED), now_).ok());
  const auto ended = store_->Finish(second.id, second.epoch, Outcome(Job::SUCCEEDED), now_);
  ASSERT_TRUE(ended.ok());
  EXPECT_TRUE(ended->empty());
  EXPECT_EQ(StateOf(twins[2]), Job::CANCELLED);
}

TEST_P(JobStoreLaws, ResultThatJobsShareStaysUntilTheLastOfThemIsDeleted) {
  NewJob job = Make();
  job.cache_key = "key";
  const std::string first = Submit(job);
  const ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Finish(first, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  job.id = "another";
  const std::string second = Submit(job);
  ASSERT_EQ(StateOf(second), Job::SUCCEEDED);
  ASSERT_TRUE(store_->Delete(first).ok());
  ASSERT_TRUE(store_->DropUnusedGrants(absl::InfiniteFuture()).ok());
  EXPECT_TRUE(IsUsed("result"));
  ASSERT_TRUE(store_->Delete(second).ok());
  ASSERT_TRUE(store_->DropUnusedGrants(absl::InfiniteFuture()).ok());
  EXPECT_FALSE(IsUsed("result"));
}

TEST_P(JobStoreLaws, RequestIdIsFreeAgainOnceItsJobIsGone) {
  NewJob job = Make();
  job.request_id = "again";
  const std::string first = Submit(job);
  ASSERT_TRUE(store_->RequestCancel(first, Outcome(Job::CANCELLED), now_).ok());
  job.id = "second";
  auto repeated = store_->Submit(job, kManyJobs, now_);
  EXPECT_TRUE(repeated.ok() && !repeated->is_new);  // also of a job that has ended
  ASSERT_TRUE(store_->Delete(first).ok());
  job.request_hash = "another request";
  repeated = store_->Submit(job, kManyJobs, now_);
  EXPECT_TRUE(repeated.ok() && repeated->is_new);
  ASSERT_TRUE(store_->RequestCancel(job.id, Outcome(Job::CANCELLED), now_).ok());
  ASSERT_TRUE(store_->RemoveExpired(now_ + absl::Hours(2)).ok());
  job.id = "third";
  job.request_hash = "a third";
  repeated = store_->Submit(job, kManyJobs, now_);
  EXPECT_TRUE(repeated.ok() && repeated->is_new);
}

TEST_P(JobStoreLaws, FinishedTwinGivesItsResultAtOnce) {
  NewJob first = Make();
  first.cache_key = "key";
  Submit(first);
  const ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Finish(first.id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  NewJob second = Make();
  second.cache_key = "key";
  const auto submitted = store_->Submit(second, 0, now_);
  ASSERT_TRUE(submitted.ok()) << submitted.status();
  EXPECT_TRUE(submitted->is_new);
  EXPECT_EQ(submitted->job.state(), Job::SUCCEEDED);
  EXPECT_TRUE(submitted->job.shared_result());
  EXPECT_EQ(submitted->job.result().mesh().sha256(), "result");
  EXPECT_TRUE(submitted->job.has_expire_time());
}

TEST_P(JobStoreLaws, QueuedTwinsWaitForTheRunningOneAndEndWithIt) {
  std::vector<std::string> ids;
  for (int i = 0; i < 3; ++i) {
    NewJob job = Make();
    job.cache_key = "key";
    ids.push_back(Submit(job));
  }
  const ClaimedJob claimed = Claim();
  EXPECT_TRUE(NothingToClaim());
  const auto twins = store_->Finish(claimed.id, claimed.epoch, Outcome(Job::SUCCEEDED), now_);
  ASSERT_TRUE(twins.ok()) << twins.status();
  EXPECT_EQ(twins->size(), 2u);
  for (const std::string& id : ids) EXPECT_EQ(StateOf(id), Job::SUCCEEDED);
  EXPECT_FALSE(store_->Get(ids[0])->shared_result());
  EXPECT_TRUE(store_->Get(ids[1])->shared_result());
}

TEST_P(JobStoreLaws, FailureIsNotShared) {
  for (int i = 0; i < 2; ++i) {
    NewJob job = Make();
    job.cache_key = "key";
    Submit(job);
  }
  const ClaimedJob first = Claim();
  const auto twins = store_->Finish(first.id, first.epoch, Outcome(Job::FAILED), now_);
  ASSERT_TRUE(twins.ok());
  EXPECT_TRUE(twins->empty());
  EXPECT_NE(Claim().id, first.id);
}

TEST_P(JobStoreLaws, ResultsAreNotSharedBetweenTenants) {
  NewJob first = MakeFor("ada");
  first.cache_key = "key";
  Submit(first);
  const ClaimedJob claimed = Claim();
  NewJob second = MakeFor("bob");
  second.cache_key = "key";
  Submit(second);
  EXPECT_EQ(Claim().id, second.id);
  ASSERT_TRUE(store_->Finish(first.id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  EXPECT_EQ(StateOf(second.id), Job::RUNNING);
  NewJob third = MakeFor("cyn");
  third.cache_key = "key";
  Submit(third);
  EXPECT_EQ(StateOf(third.id), Job::QUEUED);
}

TEST_P(JobStoreLaws, RestartOfANodeLeavesTheJobsOfOthersAlone) {
  const std::string here = Submit(Make());
  const std::string there = Submit(Make());
  Claim();
  Claimant other = AnyJob();
  other.node = "other";
  Claim(other);
  EXPECT_EQ(*store_->RequeueRunning(kNode), 1);
  EXPECT_EQ(StateOf(here), Job::QUEUED);
  EXPECT_EQ(StateOf(there), Job::RUNNING);
}

TEST_P(JobStoreLaws, TenantOwnsWhatItUploadedSubmittedAndGot) {
  ASSERT_TRUE(store_->GrantBlob("ada", Blob("upload", 1000), now_).ok());
  const std::string id = Submit(MakeFor("ada"));
  const ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Finish(id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  for (const std::string sha256 : {"upload", "input", "result"}) {
    EXPECT_TRUE(*store_->OwnsBlob("ada", sha256)) << sha256;
    EXPECT_FALSE(*store_->OwnsBlob("bob", sha256)) << sha256;
  }
  EXPECT_EQ(*store_->OwnedBytes("ada"), 1000 + 10 + 100);
  EXPECT_EQ(*store_->OwnedBytes("bob"), 0);
}

TEST_P(JobStoreLaws, OwnershipEndsWhenNothingUsesTheBlobAnyMore) {
  ASSERT_TRUE(store_->GrantBlob("ada", Blob("upload", 1000), now_).ok());
  ASSERT_TRUE(store_->GrantBlob("bob", Blob("upload", 1000), now_ + absl::Minutes(2)).ok());
  EXPECT_EQ(*store_->DropUnusedGrants(now_ + absl::Minutes(1)), 1);
  EXPECT_FALSE(*store_->OwnsBlob("ada", "upload"));
  EXPECT_TRUE(*store_->OwnsBlob("bob", "upload"));
  EXPECT_TRUE(IsUsed("upload"));
}

TEST_P(JobStoreLaws, BlobThatIsNotStoredIsNotTakenOn) {
  bool is_stored = true;
  store_->CheckBlobsWith([&](const std::string&) { return is_stored; });
  const std::string id = Submit(Make());
  const ClaimedJob claimed = Claim();
  is_stored = false;
  const auto refused = store_->Submit(MakeFor("ada"), kManyJobs, now_);
  EXPECT_EQ(ReasonOf(refused.status()), "BLOB_MISSING");
  EXPECT_EQ(ReasonOf(store_->GrantBlob("ada", Blob("upload", 1000), now_)), "BLOB_MISSING");
  const auto ended = store_->Finish(id, claimed.epoch, Outcome(Job::SUCCEEDED), now_);
  EXPECT_EQ(ReasonOf(ended.status()), "BLOB_MISSING");
  EXPECT_EQ(StateOf(id), Job::RUNNING);
  EXPECT_EQ(*store_->OwnedBytes("ada"), 0);
  EXPECT_FALSE(IsUsed("upload"));
  EXPECT_FALSE(IsUsed("result"));
  EXPECT_TRUE(NothingToClaim());
}

TEST_P(JobStoreLaws, ResultWhoseBytesAreGoneIsNotShared) {
  std::set<std::string> stored = {"input", "result"};
  store_->CheckBlobsWith([&](const std::string& sha256) { return stored.contains(sha256); });
  NewJob first = Make();
  first.cache_key = "key";
  Submit(first);
  const ClaimedJob claimed = Claim();
  ASSERT_TRUE(store_->Finish(first.id, claimed.epoch, Outcome(Job::SUCCEEDED), now_).ok());
  stored.erase("result");
  NewJob second = Make();
  second.cache_key = "key";
  Submit(second);
  EXPECT_EQ(StateOf(second.id), Job::QUEUED);
}

TEST_P(JobStoreLaws, NobodyComesToUseABlobWhileItIsHidden) {
  constexpr absl::Duration kChanceToBreakTheLaw = absl::Milliseconds(200);
  std::atomic<bool> hiding{false};
  std::atomic<bool> asked_meanwhile{false};
  store_->CheckBlobsWith([&](const std::string&) {
    asked_meanwhile = asked_meanwhile || hiding;
    return true;
  });
  std::jthread submitter;
  const auto unused = store_->CollectBlob("input", [&] {
    hiding = true;
    if (!submitter.joinable()) submitter = std::jthread([&] { Submit(Make()); });
    absl::SleepFor(kChanceToBreakTheLaw);
    hiding = false;
  });
  ASSERT_TRUE(unused.ok()) << unused.status();
  EXPECT_TRUE(*unused);
  submitter.join();
  EXPECT_FALSE(asked_meanwhile);
  EXPECT_TRUE(IsUsed("input"));
}

}  // namespace
}  // namespace amhex::server
