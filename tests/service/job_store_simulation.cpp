// Random histories of a queue: nodes that die, pause beyond their lease, wake again and report
// late; clients that submit twice and cancel; a clock that jumps. See job_store_laws.h.
#include <map>
#include <random>
#include <set>

#include "job.h"
#include "job_id.h"
#include "job_store_laws.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr int kNodes = 3;
constexpr int kSteps = 60;
constexpr int kMaxAttempts = 3;

// What a worker believes it holds. It may be wrong.
struct Held {
  std::string id;
  int64_t epoch = 0;
};

class History {
 public:
  History(JobStore* store, uint32_t seed) : store_(store), random_(seed) {}

  void Play() {
    for (int step = 0; step < kSteps && !::testing::Test::HasFailure(); ++step) Step();
    Settle();
  }

 private:
  int Roll(int sides) { return static_cast<int>(random_() % static_cast<uint32_t>(sides)); }

  void Step() {
    switch (Roll(11)) {
      case 0:
      case 1:
        return Submit();
      case 2:
      case 3:
        return Claim();
      case 4:
        return WithHeld([this](const Held& held) { Heartbeat(held); });
      case 5:
      case 6:
        return WithHeld([this](const Held& held) { Finish(held); });
      case 7:
        return WithHeld([this](const Held& held) { Release(held); });
      case 8:
        return Cancel();
      case 9:
        return Housekeep();
      default:
        return Trouble();
    }
  }

  void Submit() {
    NewJob job;
    job.id = MakeUuid(now_);
    job.tenant.name = Roll(2) == 0 ? "ada" : "bob";
    job.request_id = std::to_string(Roll(30));
    job.request_hash = "hash";
    if (Roll(3) == 0) job.cache_key = std::to_string(Roll(3));
    job.cost.memory_bytes = Roll(3);
    job.ttl = absl::Hours(1000);
    job.job.set_priority(Roll(101));
    job.job.set_max_attempts(kMaxAttempts);
    const auto submitted = store_->Submit(job, kManyJobs, now_);
    ASSERT_TRUE(submitted.ok()) << submitted.status();
    const std::string id = JobIdFromName(submitted->job.name());
    EXPECT_EQ(submitted->is_new, acknowledged_.insert(id).second);
    if (submitted->is_new && IsFinal(submitted->job.state())) MarkFinal(id);
  }

  void Claim() {
    Claimant claimant;
    claimant.node = std::to_string(Roll(kNodes));
    claimant.worker = "worker";
    claimant.lease = kLease;
    claimant.total_memory_bytes = 2;
    claimant.free_memory_bytes = Roll(3);
    const auto claimed = store_->Claim(claimant, now_);
    ASSERT_TRUE(claimed.ok()) << claimed.status();
    if (!*claimed) return;
    const ClaimedJob& job = **claimed;
    EXPECT_FALSE(final_.contains(job.id)) << "a final job was handed out";
    EXPECT_FALSE(job.job.cancel_requested()) << "a job to be cancelled was handed out";
    EXPECT_GT(job.epoch, last_epoch_[job.id]) << "an epoch was given twice";
    EXPECT_LE(job.job.attempt_count(), kMaxAttempts);
    EXPECT_LE(job.job.expected_memory_bytes(), claimant.free_memory_bytes);
    last_epoch_[job.id] = job.epoch;
    held_[claimant.node].push_back({job.id, job.epoch});
  }

  // Lets a worker act on what it believes to hold; it may believe it afterwards still, and act
  // again, as after a duplicated message.
  template <class Action>
  void WithHeld(const Action& action) {
    auto& held = held_[std::to_string(Roll(kNodes))];
    if (held.empty()) return;
    const auto chosen = static_cast<size_t>(Roll(static_cast<int>(held.size())));
    action(Held(held[chosen]));
    if (Roll(4) != 0) held.erase(held.begin() + static_cast<ptrdiff_t>(chosen));
  }

  void Heartbeat(const Held& held) {
    const auto cancel = store_->Heartbeat(held.id, held.epoch, now_, kLease);
    if (cancel.ok()) {
      ExpectHolder(held);
    } else {
      EXPECT_TRUE(absl::IsAborted(cancel.status())) << cancel.status();
    }
  }

  void Finish(const Held& held) {
    const Job::State state = Roll(3) == 0 ? Job::FAILED : Job::SUCCEEDED;
    const auto twins = store_->Finish(held.id, held.epoch, Outcome(state), now_);
    if (!twins.ok()) {
      EXPECT_TRUE(absl::IsAborted(twins.status())) << twins.status();
      return;
    }
    ExpectHolder(held);
    MarkFinal(held.id);
    for (const std::string& twin : *twins) MarkFinal(twin);
  }

  void Release(const Held& held) {
    const auto job = store_->Get(held.id);
    if (job.ok() && job->attempt_count() >= kMaxAttempts) return;  // the callers' duty
    const auto mode = Roll(2) == 0 ? ReleaseMode::kGiveAttemptBack : ReleaseMode::kSpendAttempt;
    const absl::Status status =
        store_->Release(held.id, held.epoch, mode, now_, now_ + absl::Seconds(Roll(60)));
    if (status.ok()) {
      ExpectHolder(held);
    } else if (absl::IsCancelled(status)) {
      ExpectHolder(held);
      EXPECT_TRUE(job->cancel_requested());
      EXPECT_TRUE(store_->Finish(held.id, held.epoch, Outcome(Job::CANCELLED), now_).ok());
      MarkFinal(held.id);
    } else {
      EXPECT_TRUE(absl::IsAborted(status)) << status;
    }
  }

  // Only the newest claim of a job that is not final may change it.
  void ExpectHolder(const Held& held) {
    EXPECT_EQ(held.epoch, last_epoch_[held.id]) << "an old holder was let in";
    EXPECT_FALSE(final_.contains(held.id)) << "a final job was changed";
  }

  void Cancel() {
    if (acknowledged_.empty()) return;
    auto chosen = acknowledged_.begin();
    std::advance(chosen, Roll(static_cast<int>(acknowledged_.size())));
    const auto job = store_->RequestCancel(*chosen, Outcome(Job::CANCELLED), now_);
    ASSERT_TRUE(job.ok()) << job.status();
    if (job->state() == Job::CANCELLED && !final_.contains(*chosen)) MarkFinal(*chosen);
  }

  void Housekeep() {
    const auto reaped = store_->ReapExpiredLeases(now_);
    ASSERT_TRUE(reaped.ok()) << reaped.status();
    for (const ClaimedJob& job : reaped->exhausted) {
      EXPECT_EQ(job.job.attempt_count(), kMaxAttempts);
      EXPECT_FALSE(job.job.cancel_requested());
      EXPECT_TRUE(store_->Finish(job.id, job.epoch, Outcome(Job::FAILED), now_).ok());
      MarkFinal(job.id);
    }
    for (const ClaimedJob& job : reaped->cancelled) {
      EXPECT_TRUE(store_->Finish(job.id, job.epoch, Outcome(Job::CANCELLED), now_).ok());
      MarkFinal(job.id);
    }
  }

  void Trouble() {
    const std::string node = std::to_string(Roll(kNodes));
    switch (Roll(3)) {
      case 0:  // the node dies and starts again
        held_[node].clear();
        ASSERT_TRUE(store_->RequeueRunning(node).ok());
        return;
      case 1:  // it dies for good; its leases run out
        held_[node].clear();
        return;
      default:  // every worker sleeps, perhaps beyond its lease, and believes it holds its jobs
        now_ += absl::Seconds(Roll(50));
    }
  }

  // A job is published once; what it became stays.
  void MarkFinal(const std::string& id) {
    const auto job = store_->Get(id);
    ASSERT_TRUE(job.ok()) << job.status();
    ASSERT_TRUE(IsFinal(job->state()));
    EXPECT_TRUE(final_.emplace(id, job->SerializeAsString()).second) << "published twice";
  }

  // All trouble over, every acknowledged job ends, and the final ones are as they were.
  void Settle() {
    held_.clear();
    const size_t patience = 10 * acknowledged_.size() + 10;
    for (size_t round = 0; round < patience && final_.size() < acknowledged_.size(); ++round) {
      now_ += kLease + absl::Minutes(2);
      Housekeep();
      Claimant claimant = AnyJob();
      const auto claimed = store_->Claim(claimant, now_);
      ASSERT_TRUE(claimed.ok()) << claimed.status();
      if (*claimed) {
        last_epoch_[(*claimed)->id] = (*claimed)->epoch;
        Finish({(*claimed)->id, (*claimed)->epoch});
      }
    }
    for (const std::string& id : acknowledged_) {
      EXPECT_TRUE(final_.contains(id)) << "a job was lost: " << store_->Get(id)->DebugString();
    }
    for (const auto& [id, bytes] : final_) {
      Job before;
      before.ParseFromString(bytes);
      EXPECT_EQ(store_->Get(id)->state(), before.state());
      EXPECT_EQ(store_->Get(id)->end_time().seconds(), before.end_time().seconds());
    }
  }

  JobStore* const store_;
  std::mt19937 random_;
  absl::Time now_ = absl::FromUnixSeconds(1'700'000'000);
  std::set<std::string> acknowledged_;
  std::map<std::string, std::string> final_;  // by id, the job as published
  std::map<std::string, int64_t> last_epoch_;
  std::map<std::string, std::vector<Held>> held_;  // by node
};

TEST_P(JobStoreLaws, NoHistoryLosesAJobOrPublishesOneTwice) {
  for (int seed = 0; seed < GetParam().simulated_histories && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto place = GetParam().make_quick();
    const auto store = place->Open();
    ASSERT_TRUE(store.ok()) << store.status();
    History(store->get(), static_cast<uint32_t>(seed)).Play();
  }
}

}  // namespace
}  // namespace amhex::server
