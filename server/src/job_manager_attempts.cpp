// The side of JobManager that worker slots see.
#include <algorithm>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

#include "errors.h"
#include "job.h"
#include "job_id.h"
#include "job_manager.h"
#include "job_record.h"
#include "logging.h"
#include "time_convert.h"

namespace amhex::server {

using amhex::v1::Job;

std::shared_ptr<Attempt> JobManager::WaitForAttempt(const std::string& worker,
                                                    absl::Duration patience) {
  int64_t seen = 0;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    seen = wake_count_;
  }
  if (auto attempt = draining_ ? nullptr : ClaimNext(worker)) return attempt;
  std::unique_lock<std::mutex> lock(mutex_);
  slots_wake_.wait_for(lock, absl::ToChronoMilliseconds(patience),
                       [&] { return wake_count_ != seen || stopping_ || draining_; });
  return nullptr;
}

int64_t JobManager::ReservedMemory() {
  std::lock_guard<std::mutex> lock(mutex_);
  int64_t taken = 0;
  for (const auto& entry : attempts_) taken += entry.second->job().expected_memory_bytes();
  return taken;
}

int64_t JobManager::FreeMemory() {
  const int64_t budget = options_.limits.max_running_memory_bytes;
  if (budget <= 0) return std::numeric_limits<int64_t>::max();
  return std::max<int64_t>(budget - ReservedMemory(), 0);
}

std::shared_ptr<Attempt> JobManager::ClaimNext(const std::string& worker) {
  std::unique_lock<std::mutex> claim_lock(claim_mutex_);
  Claimant claimant;
  claimant.node = options_.node;
  claimant.worker = worker;
  claimant.lease = options_.lease;
  claimant.total_memory_bytes = MostMemoryOfOneJob();
  claimant.free_memory_bytes = std::min(FreeMemory(), claimant.total_memory_bytes);
  const auto claimed = store_->Claim(claimant, absl::Now());
  if (!claimed.ok()) {
    LogError("claim_failed", {{"message", std::string(claimed.status().message())}});
  }
  if (!claimed.ok() || !claimed->has_value()) return nullptr;
  const ClaimedJob& next = **claimed;
  const Job& job = next.job;
  LogInfo("job_started", {{"job", job.name()},
                          {"attempt", int64_t{job.attempt_count()}},
                          {"epoch", next.epoch},
                          {"worker", worker}});
  if (job.attempt_count() == 1) {
    const absl::Duration wait = FromProto(job.start_time()) - FromProto(job.create_time());
    metrics_->queue_wait_seconds.Observe(std::max(absl::ToDoubleSeconds(wait), 0.0));
  }
  const auto feed = FeedFor(next.id, job);
  auto attempt = std::make_shared<Attempt>(next, feed, blobs_->NewWorkPath(next.id, next.epoch));
  {
    std::lock_guard<std::mutex> lock(mutex_);
    attempts_[next.id] = attempt;
  }
  claim_lock.unlock();
  if (options_.relay) options_.relay->Unfollow(next.id);
  // A cancel that came between the claim and the entry above left only its mark in the store.
  if (!KeepLease(*attempt)) return nullptr;
  const absl::Status refusal = quarantine_.Check(QuarantineKey(job.tenant(), job), absl::Now());
  if (!refusal.ok()) {
    Fail(*attempt, refusal);
    return nullptr;
  }
  if (!feed->PublishBegun([&] { return store_->Get(next.id); }).ok()) feed->PublishJob(job);
  return attempt;
}

void JobManager::ReportProgress(const Attempt& attempt, const amhex::v1::Progress& progress) {
  attempt.feed_->PublishProgress(progress);
}

void JobManager::ReportStage(const Attempt& attempt, const amhex::v1::StageReport& stage) {
  attempt.feed_->PublishStage(stage);
  const double seconds = absl::ToDoubleSeconds(FromProto(stage.wall_duration()));
  std::string name = amhex::v1::Stage_Name(stage.stage());
  name.erase(0, std::string("STAGE_").size());
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  metrics_->StageDuration(name).Observe(seconds);
  LogInfo("stage_done", {{"job", attempt.job().name()},
                         {"stage", name},
                         {"seconds", seconds},
                         {"peak_memory_bytes", stage.peak_memory_bytes()}});
}

bool JobManager::KeepLease(Attempt& attempt) {
  const auto cancel = store_->Heartbeat(attempt.id(), attempt.epoch(), absl::Now(), options_.lease);
  if (cancel.ok()) {
    if (*cancel) attempt.RequestCancel();
    return true;
  }
  if (!absl::IsAborted(cancel.status())) {
    // The store is in trouble; the lease may still be ours, and Finish will tell.
    LogError("heartbeat_failed",
             {{"job", attempt.job().name()}, {"message", std::string(cancel.status().message())}});
    return true;
  }
  LogWarning("attempt_fenced", {{"job", attempt.job().name()}, {"epoch", attempt.epoch()}});
  Forget(attempt);
  return false;
}

void JobManager::Forget(const Attempt& attempt) {
  unlink(attempt.work_path().c_str());
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto running = attempts_.find(attempt.id());
    if (running != attempts_.end() && running->second.get() == &attempt) attempts_.erase(running);
  }
  // A job may have waited for this one's memory.
  if (options_.limits.max_running_memory_bytes > 0) WakeSlots();
}

void JobManager::Finish(Attempt& attempt, const FinalOutcome& outcome) {
  // Makes room first: on a full disk the outcome could not be recorded beside an unfinished result.
  unlink(attempt.work_path().c_str());
  FinalOutcome complete = outcome;
  const Job live = attempt.feed_->Current();
  *complete.details.mutable_stages() = live.stages();
  if (outcome.state != Job::SUCCEEDED) {
    complete.details.set_failed_stage(live.progress().stage());
  }
  const auto twins = FinishPatiently(attempt, complete);
  if (attempt.cancel_requested()) {
    const int64_t nanos = absl::GetCurrentTimeNanos() - attempt.cancel_time_nanos_;
    metrics_->cancel_latency_seconds.Observe(1e-9 * static_cast<double>(nanos));
  }
  Forget(attempt);
  if (!twins.ok()) {
    LogError("finish_not_recorded", {{"job", attempt.job().name()},
                                     {"epoch", attempt.epoch()},
                                     {"message", std::string(twins.status().message())}});
    return;
  }
  PublishFinished(attempt.id());
  for (const std::string& twin : *twins) PublishFinished(twin);
}

void JobManager::PublishFinished(const std::string& id) {
  PublishStored(id);
  const auto job = store_->Get(id);
  if (job.ok()) CountFinished(*job);
}

absl::StatusOr<amhex::v1::BlobRef> JobManager::AdoptResult(const Attempt& attempt) {
  auto mesh = blobs_->Adopt(attempt.work_path());
  if (ReasonOf(mesh.status()) != "STORAGE_FULL") return mesh;
  // What it took to compute is worth more than what may go, which else goes once a minute.
  std::error_code error;
  const auto size = std::filesystem::file_size(attempt.work_path(), error);
  CollectGarbage(error ? 0 : static_cast<int64_t>(size));
  return blobs_->Adopt(attempt.work_path());
}

void JobManager::Succeed(Attempt& attempt, amhex::v1::MeshingResult result) {
  const absl::StatusOr<amhex::v1::BlobRef> mesh = AdoptResult(attempt);
  if (!mesh.ok()) {
    Fail(attempt, mesh.status());
    return;
  }
  *result.mutable_mesh() = *mesh;
  const amhex::v1::MeshStatistics& statistics = result.statistics();
  metrics_->cells.Observe(static_cast<double>(statistics.cell_count()));
  metrics_->hexahedra_ratio.Observe(statistics.hexahedra_ratio());
  ObserveMemory(attempt);
  quarantine_.Forgive(QuarantineKey(attempt.job().tenant(), attempt.job()));
  for (const auto& count : statistics.cells_by_type()) {
    std::string type = amhex::v1::CellType_Name(count.type());
    type.erase(0, std::string("CELL_TYPE_").size());
    std::transform(type.begin(), type.end(), type.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    metrics_->Primitives(type).Increment(static_cast<double>(count.cell_count()));
  }
  FinalOutcome outcome;
  outcome.state = Job::SUCCEEDED;
  *outcome.details.mutable_result() = std::move(result);
  Finish(attempt, outcome);
}

void JobManager::ObserveMemory(const Attempt& attempt) {
  int64_t most = 0;
  const Job live = attempt.feed_->Current();
  for (const auto& stage : live.stages()) most = std::max(most, stage.peak_memory_bytes());
  const int64_t expected = attempt.job().expected_memory_bytes();
  if (most <= 0 || expected <= 0) return;
  metrics_->memory_estimate_ratio.Observe(static_cast<double>(expected) /
                                          static_cast<double>(most));
}

void JobManager::Fail(Attempt& attempt, const absl::Status& error) {
  Finish(attempt, ErrorOutcome(Job::FAILED, error));
}

void JobManager::EndCancelled(Attempt& attempt) { Finish(attempt, CancelledOutcome()); }

void JobManager::DecoderDied(Attempt& attempt, const std::string& how) {
  constexpr int kDeaths = 1;
  quarantine_.NoteDeaths(QuarantineKey(attempt.job().tenant(), attempt.job()), kDeaths,
                         absl::Now());
  Fail(attempt, MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::INPUT_DECODE_LIMIT,
                          "the input killed the decoder: " + how));
}

void JobManager::WorkerDied(Attempt& attempt, const std::string& how, Suspect suspect) {
  const int attempts = attempt.job().attempt_count();
  LogWarning("worker_died_in_job",
             {{"job", attempt.job().name()}, {"attempt", int64_t{attempts}}, {"how", how}});
  if (attempt.cancel_requested()) return EndCancelled(attempt);
  if (attempts >= attempt.job().max_attempts()) {
    // Not before: one death may have been nobody's fault, and equal jobs may be running.
    if (suspect == Suspect::kJob) {
      quarantine_.NoteDeaths(QuarantineKey(attempt.job().tenant(), attempt.job()), attempts,
                             absl::Now());
    }
    Fail(attempt, AttemptsExhausted(attempts, how));
    return;
  }
  constexpr int kMaxDoublings = 8;
  const absl::Duration delay = options_.retry_delay * (1 << std::min(attempts - 1, kMaxDoublings));
  Requeue(attempt, ReleaseMode::kSpendAttempt, delay);
}

void JobManager::GiveBack(Attempt& attempt) {
  LogInfo("job_given_back", {{"job", attempt.job().name()}});
  Requeue(attempt, ReleaseMode::kGiveAttemptBack, absl::ZeroDuration());
}

void JobManager::Requeue(Attempt& attempt, ReleaseMode mode, absl::Duration delay) {
  const absl::Time now = absl::Now();
  const absl::Status status =
      store_->Release(attempt.id(), attempt.epoch(), mode, now, now + delay);
  if (absl::IsCancelled(status)) return EndCancelled(attempt);
  Forget(attempt);
  if (!status.ok()) LogError("release_failed", {{"job", attempt.job().name()}});
  PublishStored(attempt.id());
}

}  // namespace amhex::server
