#include "worker_slot.h"

#include <signal.h>

#include <algorithm>
#include <utility>

#include "errors.h"
#include "logging.h"
#include "monotonic_clock.h"
#include "status_macros.h"
#include "time_convert.h"
#include "worker/worker_fd.h"
#include "worker_probe.h"

namespace amhex::server {
namespace {

using amhex::worker::FromWorker;
using amhex::worker::ToWorker;

constexpr absl::Duration kIdleCheckInterval = absl::Seconds(1);
constexpr absl::Duration kMaxRestartDelay = absl::Seconds(30);
// One input dies three times at most before its job fails (Limits::max_attempts); a good worker
// passes the trial in a fraction of a second.
constexpr int kDeathsBeforeProbe = 3;
constexpr int kFaultsBeforeQuarantine = 3;
// Events in a run are looked for at least this often.
constexpr absl::Duration kMinNewsWait = absl::Milliseconds(1);
constexpr absl::Duration kMaxNewsWait = absl::Milliseconds(250);
// Beyond its deadline a worker that does not react is stopped from outside.
constexpr absl::Duration kRunTimeoutGrace = absl::Seconds(2);

bool IsCrashSignal(int signal) {
  return signal == SIGABRT || signal == SIGSEGV || signal == SIGBUS || signal == SIGFPE ||
         signal == SIGILL;
}

WorkerCommand CommandOf(const WorkerPool::Options& options, int number) {
  WorkerCommand command = options.command;
  const auto& devices = options.cuda_devices;
  if (!devices.empty()) command.cuda_device = devices[static_cast<size_t>(number) % devices.size()];
  return command;
}

absl::Status RunTimeout() {
  return MakeError(absl::StatusCode::kDeadlineExceeded, amhex::v1::RUN_TIMEOUT,
                   "the job ran longer than its run_timeout");
}

}  // namespace

WorkerSlot::WorkerSlot(WorkerPool* pool, int number)
    : pool_(pool),
      manager_(pool->manager_),
      number_(number),
      name_("worker-" + std::to_string(number)),
      command_(CommandOf(pool->options_, number)) {}

WorkerSlot::~WorkerSlot() { Join(); }

void WorkerSlot::Start() {
  thread_ = std::thread([this] { Loop(); });
}

void WorkerSlot::StartStopping(absl::Time deadline) {
  {
    std::lock_guard<std::mutex> lock(sleep_mutex_);
    // Whoever is in more of a hurry is obeyed.
    const int64_t nanos = absl::ToUnixNanos(MonotonicNow() + (deadline - absl::Now()));
    stop_deadline_nanos_ = std::min(stop_deadline_nanos_.load(), nanos);
    stopping_ = true;
  }
  sleep_wake_.notify_all();
}

void WorkerSlot::Join() {
  if (thread_.joinable()) thread_.join();
}

bool WorkerSlot::Stopping() const { return stopping_.load(); }

void WorkerSlot::Loop() {
  while (!Stopping()) {
    if (!EnsureProcess()) continue;
    CheckIdleProcess();
    if (!process_) continue;
    if (auto attempt = manager_->WaitForAttempt(name_, kIdleCheckInterval)) {
      RunAttempt(std::move(attempt));
    }
  }
  LoseProcess("");
  SetQuarantined(false);
}

bool WorkerSlot::WaitBeforeStart() {
  if (failed_starts_ == 0) return !Stopping();
  const int doublings = std::min(failed_starts_ - 1, 10);
  const absl::Duration delay =
      std::min(absl::Milliseconds(100) * (1 << doublings), kMaxRestartDelay);
  std::unique_lock<std::mutex> lock(sleep_mutex_);
  sleep_wake_.wait_for(lock, absl::ToChronoMilliseconds(delay), [this] { return Stopping(); });
  return !Stopping();
}

// Deaths in jobs alone do not tell bad inputs from a bad device; a job known to be good does.
bool WorkerSlot::NeedsProbe() const {
  return device_lost_ || failed_starts_ >= kFaultsBeforeQuarantine ||
         deaths_in_jobs_ >= kDeathsBeforeProbe;
}

absl::Status WorkerSlot::StartProcess() {
  const WorkerPool::Options& options = pool_->options_;
  AMHEX_ASSIGN_OR_RETURN(process_, WorkerProcess::Start(command_, options.start_patience));
  if (!NeedsProbe()) return absl::OkStatus();
  const absl::Status verdict =
      ProbeWorker(&process_->channel(), {manager_->ScratchPath(name_ + "-probe"),
                                         manager_->ScratchPath(name_ + "-probe-result"),
                                         options.probe_patience, [this] { return Stopping(); }});
  if (!verdict.ok()) {
    process_.reset();
    return verdict;
  }
  failed_starts_ = 0;
  deaths_in_jobs_ = 0;
  device_lost_ = false;
  LogInfo("worker_probed", {{"worker", name_}});
  return absl::OkStatus();
}

void WorkerSlot::SetQuarantined(bool quarantined) {
  if (quarantined == quarantined_) return;
  quarantined_ = quarantined;
  pool_->ChangeQuarantinedCount(quarantined ? 1 : -1);
  if (quarantined) {
    LogError("worker_quarantined", {{"worker", name_}, {"failures", int64_t{failed_starts_}}});
  }
}

// True when a worker is up; waits a while after failures.
bool WorkerSlot::EnsureProcess() {
  if (process_) return true;
  if (!WaitBeforeStart()) return false;
  const absl::Status started = StartProcess();
  if (!started.ok()) {
    if (Stopping()) return false;
    ++failed_starts_;
    LogError("worker_start_failed", {{"worker", name_},
                                     {"failures", int64_t{failed_starts_}},
                                     {"message", std::string(started.message())}});
    SetQuarantined(failed_starts_ >= kFaultsBeforeQuarantine);
    return false;
  }
  SetQuarantined(false);
  pid_ = process_->pid();
  pool_->TakeHello(number_, process_->hello());
  pool_->ChangeReadyCount(1);
  LogInfo("worker_ready", {{"worker", name_},
                           {"worker_pid", int64_t{process_->pid()}},
                           {"cuda_device", command_.cuda_device},
                           {"engine", process_->hello().engine_version()}});
  return true;
}

void WorkerSlot::NoteDeviceLoss(const WorkerExit& exit) {
  if (exit.exit_code != kDeviceLostExitCode) return;
  device_lost_ = true;
  manager_->metrics().device_faults.Increment();
}

// An idle worker has nothing to say; if its socket speaks, it has died.
void WorkerSlot::CheckIdleProcess() {
  FromWorker news;
  const auto outcome = process_->channel().Receive(&news, absl::ZeroDuration());
  if (outcome.ok() && *outcome == FrameChannel::Outcome::kTimeout) return;
  process_->Kill();
  const WorkerExit exit = process_->Wait();
  LogWarning("worker_died_idle", {{"worker", name_}, {"how", exit.Description()}});
  ++failed_starts_;
  NoteDeviceLoss(exit);
  LoseProcess("idle_death");
}

void WorkerSlot::LoseProcess(const std::string& cause) {
  if (!process_) return;
  process_.reset();
  pid_ = 0;
  pool_->ChangeReadyCount(-1);
  if (!cause.empty()) manager_->metrics().WorkerRestarts(cause).Increment();
}

bool WorkerSlot::SendOrder(const Attempt& attempt) {
  const Limits& limits = manager_->options().limits;
  const amhex::v1::Job& job = attempt.job();
  ToWorker frame;
  auto& order = *frame.mutable_run();
  order.set_job(job.name());
  order.set_input_path(manager_->PathOfBlob(job.input().sha256()));
  order.set_input_encoding(job.input_encoding());
  order.mutable_input_limits()->set_max_point_count(limits.max_point_count);
  order.mutable_input_limits()->set_max_triangle_count(limits.max_triangle_count);
  order.mutable_input_limits()->set_max_attribute_count(limits.max_attribute_count);
  *order.mutable_params() = job.params();
  *order.mutable_run_timeout() = job.run_timeout();
  order.set_output_path(attempt.work_path());
  order.set_memory_limit_bytes(limits.max_worker_memory_bytes);
  return process_->channel().Send(frame).ok();
}

void WorkerSlot::RunAttempt(std::shared_ptr<Attempt> attempt) {
  Run run;
  const absl::Time now = MonotonicNow();
  run.attempt = std::move(attempt);
  run.next_heartbeat = now + manager_->options().lease / 3;
  run.run_deadline = now + FromProto(run.attempt->job().run_timeout()) + kRunTimeoutGrace;
  if (!SendOrder(*run.attempt)) {
    HandleDeath(&run);
    return;
  }
  while (!run.over) {
    CheckStopCauses(&run);
    if (!run.over) WaitForNews(&run);
  }
}

void WorkerSlot::CheckStopCauses(Run* run) {
  const absl::Time now = MonotonicNow();
  if (now >= run->next_heartbeat) {
    run->next_heartbeat = now + manager_->options().lease / 3;
    if (!manager_->KeepLease(*run->attempt)) {
      LoseProcess("fenced");
      run->over = true;
      return;
    }
  }
  if (run->stop_cause == StopCause::kNone) {
    if (run->attempt->cancel_requested()) {
      AskToStop(StopCause::kCancel, run);
    } else if (now >= run->run_deadline) {
      AskToStop(StopCause::kTimeout, run);
    } else if (Stopping() && absl::ToUnixNanos(now) >= stop_deadline_nanos_) {
      AskToStop(StopCause::kShutdown, run);
    } else if (now >= run->decode_deadline) {
      run->stop_cause = StopCause::kSlowDecoder;
      run->kill_time = now;
    }
  }
  // Its death is noticed as the end of the socket.
  if (now >= run->kill_time) process_->Kill();
}

void WorkerSlot::AskToStop(StopCause cause, Run* run) {
  run->stop_cause = cause;
  const WorkerPool::Options& options = pool_->options_;
  const absl::Duration patience = cause == StopCause::kCancel
                                      ? std::min(options.cancel_patience, options.stop_patience)
                                      : options.stop_patience;
  run->kill_time = MonotonicNow() + patience;
  ToWorker frame;
  frame.mutable_stop();
  // If it cannot be sent the worker is dead, which the next Receive tells.
  process_->channel().Send(frame).IgnoreError();
}

void WorkerSlot::WaitForNews(Run* run) {
  FromWorker news;
  const int wake_fd = run->stop_cause == StopCause::kNone ? run->attempt->wake_fd() : -1;
  const absl::Duration wait =
      std::clamp(run->kill_time - MonotonicNow(), kMinNewsWait, kMaxNewsWait);
  const auto outcome = process_->channel().Receive(&news, wait, wake_fd);
  if (!outcome.ok()) {
    process_->Kill();
    HandleDeath(run);
  } else if (*outcome == FrameChannel::Outcome::kFrame) {
    run->silence = absl::ZeroDuration();
    Handle(news, run);
  } else if (*outcome == FrameChannel::Outcome::kTimeout) {
    CheckSilence(wait, run);
  }
}

// Only time in which this process waited counts: when it was frozen itself, the worker's signs of
// life are in the socket, or the whole machine slept.
void WorkerSlot::CheckSilence(absl::Duration more, Run* run) {
  run->silence += more;
  if (run->stop_cause != StopCause::kNone || run->silence < pool_->options_.silence_patience) {
    return;
  }
  LogWarning("worker_silent", {{"worker", name_}, {"job", run->attempt->job().name()}});
  run->stop_cause = StopCause::kSilence;
  run->kill_time = absl::InfinitePast();
}

void WorkerSlot::Handle(const FromWorker& news, Run* run) {
  switch (news.news_case()) {
    case FromWorker::kProgress:
      run->stage = news.progress().stage();
      run->decode_deadline = run->stage == amhex::v1::STAGE_DECODE_INPUT
                                 ? MonotonicNow() + pool_->options_.decode_patience
                                 : absl::InfiniteFuture();
      manager_->ReportProgress(*run->attempt, news.progress());
      break;
    case FromWorker::kStage:
      run->decode_deadline = absl::InfiniteFuture();
      manager_->ReportStage(*run->attempt, news.stage());
      break;
    case FromWorker::kFinished:
      HandleFinished(news.finished(), run);
      break;
    case FromWorker::kHello:
    case FromWorker::NEWS_NOT_SET:
      break;
  }
}

void WorkerSlot::HandleFinished(const amhex::worker::Finished& finished, Run* run) {
  run->over = true;
  failed_starts_ = 0;
  deaths_in_jobs_ = 0;
  const absl::Status error = FromRpcStatus(finished.error());
  if (error.ok()) {
    manager_->Succeed(*run->attempt, finished.result());
  } else if (absl::IsCancelled(error) && run->stop_cause == StopCause::kCancel) {
    manager_->EndCancelled(*run->attempt);
  } else if (absl::IsCancelled(error) && run->stop_cause == StopCause::kShutdown) {
    manager_->GiveBack(*run->attempt);
  } else if (absl::IsCancelled(error) && run->stop_cause == StopCause::kTimeout) {
    manager_->Fail(*run->attempt, RunTimeout());
  } else {
    manager_->Fail(*run->attempt, error);
  }
}

void WorkerSlot::HandleDeath(Run* run) {
  run->over = true;
  process_->Kill();
  const WorkerExit exit = process_->Wait();
  switch (run->stop_cause) {
    case StopCause::kCancel:
      manager_->EndCancelled(*run->attempt);
      break;
    case StopCause::kTimeout:
      manager_->Fail(*run->attempt, RunTimeout());
      break;
    case StopCause::kShutdown:
      manager_->GiveBack(*run->attempt);
      break;
    case StopCause::kSlowDecoder:
      manager_->Fail(*run->attempt,
                     MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::INPUT_DECODE_LIMIT,
                               "decoding the input took longer than " +
                                   absl::FormatDuration(pool_->options_.decode_patience)));
      break;
    case StopCause::kSilence:
      ++deaths_in_jobs_;
      manager_->WorkerDied(
          *run->attempt,
          "it gave no sign of life for " + absl::FormatDuration(pool_->options_.silence_patience),
          JobManager::Suspect::kJob);
      break;
    case StopCause::kNone:
      ++deaths_in_jobs_;
      NoteDeviceLoss(exit);
      if (run->stage == amhex::v1::STAGE_DECODE_INPUT && IsCrashSignal(exit.signal)) {
        manager_->DecoderDied(*run->attempt, exit.Description());
      } else {
        manager_->WorkerDied(*run->attempt, exit.Description(),
                             exit.exit_code == kDeviceLostExitCode ? JobManager::Suspect::kDevice
                                                                   : JobManager::Suspect::kJob);
      }
      break;
  }
  LoseProcess(run->stop_cause == StopCause::kNone      ? "death_in_job"
              : run->stop_cause == StopCause::kSilence ? "silence"
                                                       : "killed");
}

}  // namespace amhex::server
