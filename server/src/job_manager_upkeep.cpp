// What JobManager does on its own: quiet watchers, leases, timeouts, room on the disk.
#include <algorithm>
#include <utility>
#include <vector>

#include "errors.h"
#include "job.h"
#include "job_id.h"
#include "job_manager.h"
#include "job_record.h"
#include "logging.h"
#include "monotonic_clock.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr absl::Duration kTick = absl::Milliseconds(50);
constexpr absl::Duration kQueueInterval = absl::Seconds(1);
constexpr absl::Duration kGarbageInterval = absl::Minutes(1);
// Looking for what may go reads every blob's name; inputs that find no room may come by the
// thousand.
constexpr absl::Duration kInputRoomInterval = absl::Seconds(1);
// Frames of a job that does not run are kept this long for readers that reconnect.
constexpr absl::Duration kFinalFeedAge = absl::Minutes(2);

}  // namespace

void JobManager::Housekeep() {
  absl::Time next_queue = MonotonicNow();
  absl::Time next_garbage = MonotonicNow();
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stopping_) {
    lock.unlock();
    TendWatchedFeeds();
    if (MonotonicNow() >= next_queue) {
      TendQueue();
      if (options_.relay) TendForeignFeeds();
      ForgetQuietFeeds();
      next_queue = MonotonicNow() + kQueueInterval;
    }
    if (MonotonicNow() >= next_garbage) {
      CollectGarbage(0);
      next_garbage = MonotonicNow() + kGarbageInterval;
    }
    lock.lock();
    housekeeper_wake_.wait_for(lock, absl::ToChronoMilliseconds(kTick),
                               [this] { return stopping_; });
  }
}

// Wakes readers that wait for their interval, and breaks silences.
void JobManager::TendWatchedFeeds() {
  std::vector<std::shared_ptr<JobFeed>> feeds;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    watched_feeds_.erase(std::remove_if(watched_feeds_.begin(), watched_feeds_.end(),
                                        [](const auto& feed) { return feed->reader_count() == 0; }),
                         watched_feeds_.end());
    feeds = watched_feeds_;
  }
  int64_t readers = 0;
  for (const auto& feed : feeds) {
    readers += feed->reader_count();
    const absl::Duration quiet = MonotonicNow() - feed->last_publish_time();
    if (quiet > options_.quiet_feed_interval && !IsFinal(feed->state())) {
      BreakSilence(feed);
    }
    feed->WakeReaders();
  }
  metrics_->watchers.Set(static_cast<double>(readers));
}

void JobManager::BreakSilence(const std::shared_ptr<JobFeed>& feed) {
  // A second chance for news that the store failed to give; in a cluster, see TendForeignFeeds.
  if (!options_.relay) {
    const auto job = PublishTo(feed, JobIdFromName(feed->Current().name()));
    if (absl::IsNotFound(job.status())) return feed->Close(job.status());
  }
  feed->Repeat();
}

void JobManager::LetFeedGo(const std::string& id, const Job& job) {
  const auto feed = FindFeed(id);
  if (!feed) return;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    feeds_.erase(id);
  }
  // The job may have ended and gone between the two steps in which an end is stored and told.
  if (IsFinal(job.state())) feed->PublishJob(job);
  if (!IsFinal(feed->state())) feed->Close(JobNotFound(id));
}

void JobManager::ForgetQuietFeeds() {
  std::lock_guard<std::mutex> lock(mutex_);
  const absl::Time oldest = MonotonicNow() - kFinalFeedAge;
  for (auto entry = feeds_.begin(); entry != feeds_.end();) {
    // Attempts, readers and calls under way hold the feed too; they got it under the lock.
    const bool needed =
        entry->second.use_count() > 1 || entry->second->last_publish_time() > oldest;
    entry = needed ? std::next(entry) : feeds_.erase(entry);
  }
}

void JobManager::EndReaped(const ReapedLeases& reaped, absl::Time now) {
  for (const std::string& id : reaped.requeued) {
    metrics_->lease_expired.Increment();
    LogWarning("lease_expired", {{"job", JobName(id)}});
  }
  for (const ClaimedJob& job : reaped.exhausted) {
    EndReapedJob(job,
                 ErrorOutcome(Job::FAILED, AttemptsExhausted(job.job.attempt_count(),
                                                             "silence beyond its lease")),
                 now);
  }
  for (const ClaimedJob& job : reaped.cancelled) EndReapedJob(job, CancelledOutcome(), now);
}

void JobManager::EndReapedJob(const ClaimedJob& job, const FinalOutcome& outcome, absl::Time now) {
  // Several nodes may find the same job; one of them ends it, and counts it.
  if (!store_->Finish(job.id, job.epoch, outcome, now).ok()) return;
  metrics_->lease_expired.Increment();
  LogWarning("lease_expired", {{"job", JobName(job.id)}});
  PublishFinished(job.id);
}

// Where this process stood still for longer than a lease, or the clock was set, the leases of its
// own attempts have ended by the calendar, though nobody was there to take them over.
void JobManager::KeepLeasesAfterAJump(absl::Time now) {
  const absl::Duration gap = now - std::exchange(last_tended_, now);
  if (options_.relay || gap < kQueueInterval + options_.lease / 3) return;
  std::vector<std::shared_ptr<Attempt>> attempts;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& entry : attempts_) attempts.push_back(entry.second);
  }
  for (const auto& attempt : attempts) KeepLease(*attempt);
}

void JobManager::TendQueue() {
  const absl::Time now = absl::Now();
  KeepLeasesAfterAJump(now);
  const auto reaped = store_->ReapExpiredLeases(now);
  metrics_->store_up.Set(reaped.ok() ? 1 : 0);
  // The other calls would only wait as well, and watchers with them.
  if (absl::IsUnavailable(reaped.status())) return;
  if (reaped.ok()) EndReaped(*reaped, now);
  const auto timed_out = store_->ExpireQueued(
      ErrorOutcome(Job::FAILED,
                   MakeError(absl::StatusCode::kDeadlineExceeded, amhex::v1::QUEUE_TIMEOUT,
                             "the job waited in the queue longer than its queue_timeout")),
      now);
  if (timed_out.ok()) {
    for (const std::string& id : *timed_out) PublishFinished(id);
  }
  if (const auto removed = store_->RemoveExpired(now); removed.ok()) {
    for (const std::string& id : *removed) LetFeedGo(id, Job());
  }
  if (const auto counts = store_->CountByState(); counts.ok()) {
    for (const Job::State state :
         {Job::QUEUED, Job::RUNNING, Job::SUCCEEDED, Job::FAILED, Job::CANCELLED}) {
      const auto found = counts->find(state);
      metrics_->JobsInState(Job::State_Name(state))
          .Set(found == counts->end() ? 0 : static_cast<double>(found->second));
    }
  }
  const auto oldest = store_->OldestQueued();
  const bool waiting = oldest.ok() && oldest->has_value();
  metrics_->queue_oldest_age_seconds.Set(waiting ? absl::ToDoubleSeconds(now - **oldest) : 0);
  if (const auto cost = store_->QueuedCost(); cost.ok()) {
    metrics_->queue_cost_seconds.Set(absl::ToDoubleSeconds(*cost));
  }
  metrics_->memory_reserved_bytes.Set(static_cast<double>(ReservedMemory()));
  metrics_->blob_store_bytes.Set(static_cast<double>(blobs_->total_bytes()));
  if (const auto left = blobs_->FreeDiskBytes(); left.ok()) {
    metrics_->disk_free_bytes.Set(static_cast<double>(*left));
  }
}

int64_t JobManager::CollectUnused(absl::Time unused_since) {
  const auto dropped = store_->DropUnusedGrants(unused_since);
  if (!dropped.ok()) LogError("grants_not_dropped", {});
  return blobs_->Collect(unused_since, absl::Now() - options_.resting_upload_age,
                         [this](const std::string& sha256, const std::function<void()>& hide) {
                           // One by one, so that submissions wait for one at most.
                           std::lock_guard<std::mutex> admission(admission_mutex_);
                           const auto unused = store_->CollectBlob(sha256, hide);
                           return unused.ok() && *unused;
                         });
}

void JobManager::MakeRoom(absl::Time now, int64_t wanted_bytes) {
  constexpr int kJobsAtOnce = 16;
  const int64_t budget = options_.limits.max_blob_store_bytes;
  const auto taken = [&] {
    return blobs_->total_bytes() + blobs_->uploading_bytes() + wanted_bytes;
  };
  if (budget <= 0 || taken() <= budget / 10 * 9) return;
  const absl::Time before = now - options_.scarce_blob_age;
  int64_t freed = CollectUnused(before);
  while (taken() > budget / 10 * 8) {
    const auto removed = store_->RemoveOldestFinal(kJobsAtOnce, before);
    if (!removed.ok() || removed->empty()) break;
    LogWarning("jobs_removed_for_room", {{"count", static_cast<int64_t>(removed->size())}});
    freed += CollectUnused(before);
  }
  LogInfo("room_made", {{"bytes", freed}, {"taken", taken()}});
}

bool JobManager::MakeRoomForInput(int64_t bytes) {
  if (blobs_->HasBudgetFor(bytes)) return false;
  std::lock_guard<std::mutex> lock(input_room_mutex_);
  // One of those that waited here may have made room for all of them.
  if (MonotonicNow() >= next_input_room_) {
    MakeRoom(absl::Now(), bytes);
    next_input_room_ = MonotonicNow() + kInputRoomInterval;
  }
  return blobs_->HasBudgetFor(bytes);
}

void JobManager::CollectGarbage(int64_t wanted_bytes) {
  const absl::Time now = absl::Now();
  const int64_t freed = CollectUnused(now - options_.unused_blob_age);
  if (freed > 0) LogInfo("blobs_collected", {{"bytes", freed}});
  MakeRoom(now, wanted_bytes);
}

}  // namespace amhex::server
