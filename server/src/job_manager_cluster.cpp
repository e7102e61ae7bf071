// The side of JobManager that knows of other nodes: changes they make, and jobs they run.
#include <algorithm>
#include <utility>

#include "job.h"
#include "job_id.h"
#include "job_manager.h"
#include "logging.h"
#include "monotonic_clock.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr absl::Duration kFinishRetryPause = absl::Milliseconds(250);

}  // namespace

std::shared_ptr<Attempt> JobManager::FindAttempt(const std::string& id) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto running = attempts_.find(id);
  return running == attempts_.end() ? nullptr : running->second;
}

void JobManager::HearOfChange(const std::string& id) {
  WakeSlots();
  if (id.empty()) return;  // housekeeping looks after all feeds every second
  if (const auto attempt = FindAttempt(id)) {
    const auto job = store_->Get(id);
    if (job.ok() && job->cancel_requested()) attempt->RequestCancel();
    return;
  }
  const auto feed = FindFeed(id);
  if (feed && feed->reader_count() > 0) RefreshForeignFeed(id, feed);
}

void JobManager::TendForeignFeeds() {
  std::vector<std::shared_ptr<JobFeed>> feeds;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    feeds = watched_feeds_;
  }
  for (const auto& feed : feeds) {
    RefreshForeignFeed(JobIdFromName(feed->Current().name()), feed);
  }
}

void JobManager::RefreshForeignFeed(const std::string& id, const std::shared_ptr<JobFeed>& feed) {
  if (IsFinal(feed->state()) || FindAttempt(id)) return;
  const auto job = PublishTo(feed, id);
  if (absl::IsNotFound(job.status())) feed->Close(job.status());
  if (!job.ok()) return;
  if (job->state() != Job::RUNNING) return;
  const auto address = store_->RunnerAddress(id);
  // A job that runs here by the store, but not by this node's knowledge, has just been claimed, or
  // was lost and will be put back.
  if (!address.ok() || address->empty() || *address == options_.address) return;
  options_.relay->Follow(id, *address, feed);
}

absl::StatusOr<std::vector<std::string>> JobManager::FinishPatiently(const Attempt& attempt,
                                                                     const FinalOutcome& outcome) {
  const absl::Time deadline = MonotonicNow() + options_.lease;
  while (true) {
    auto twins = store_->Finish(attempt.id(), attempt.epoch(), outcome, absl::Now());
    if (!absl::IsUnavailable(twins.status()) || MonotonicNow() >= deadline) return twins;
    absl::SleepFor(kFinishRetryPause);
  }
}

}  // namespace amhex::server
