// One worker of the pool: a thread and the child process it looks after.
#pragma once

#include <atomic>
#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "worker_pool.h"

namespace amhex::server {

class WorkerSlot {
 public:
  WorkerSlot(WorkerPool* pool, int number);
  ~WorkerSlot();

  void Start();
  // Takes no more jobs; what runs at `deadline` is given back.
  void StartStopping(absl::Time deadline);
  void Join();

  pid_t pid() const { return pid_.load(); }

 private:
  // Why the child was asked to stop, if it was.
  enum class StopCause { kNone, kCancel, kTimeout, kShutdown, kSlowDecoder, kSilence };

  struct Run {
    std::shared_ptr<Attempt> attempt;
    StopCause stop_cause = StopCause::kNone;
    absl::Time kill_time = absl::InfiniteFuture();
    absl::Time next_heartbeat;
    absl::Time run_deadline;
    absl::Time decode_deadline = absl::InfiniteFuture();
    amhex::v1::Stage stage = amhex::v1::STAGE_UNSPECIFIED;
    // Waited for the worker in vain since it last said something.
    absl::Duration silence;
    bool over = false;
  };

  void Loop();
  bool Stopping() const;
  bool EnsureProcess();
  // Waits after failures to start; false when stopping.
  bool WaitBeforeStart();
  // Starts a process and, where its predecessors give reason to, has it pass the trial job.
  absl::Status StartProcess();
  bool NeedsProbe() const;
  void SetQuarantined(bool quarantined);
  void CheckIdleProcess();
  void NoteDeviceLoss(const WorkerExit& exit);
  void RunAttempt(std::shared_ptr<Attempt> attempt);
  bool SendOrder(const Attempt& attempt);
  void WaitForNews(Run* run);
  void CheckSilence(absl::Duration more, Run* run);
  void Handle(const amhex::worker::FromWorker& news, Run* run);
  void HandleFinished(const amhex::worker::Finished& finished, Run* run);
  void HandleDeath(Run* run);
  void CheckStopCauses(Run* run);
  void AskToStop(StopCause cause, Run* run);
  void LoseProcess(const std::string& cause);

  WorkerPool* const pool_;
  JobManager* const manager_;
  const int number_;
  const std::string name_;
  const WorkerCommand command_;
  std::unique_ptr<WorkerProcess> process_;
  std::atomic<pid_t> pid_{0};
  // Since a job or the trial last came to a verdict:
  int failed_starts_ = 0;   // no start, death when idle, trial failed; the next start waits longer
  int deaths_in_jobs_ = 0;  // the jobs may be to blame
  bool device_lost_ = false;
  bool quarantined_ = false;
  std::atomic<bool> stopping_{false};
  std::atomic<int64_t> stop_deadline_nanos_{std::numeric_limits<int64_t>::max()};
  std::mutex sleep_mutex_;
  std::condition_variable sleep_wake_;
  std::thread thread_;
};

}  // namespace amhex::server
