// Starts the workers, hands them jobs, watches, stops and replaces them.
//
// One thread per worker: it waits for an attempt, relays what the child says, and decides what a
// child's death means. Nothing else in the server knows that workers are processes.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "job_manager.h"
#include "worker/worker_protocol.pb.h"
#include "worker_process.h"

namespace amhex::server {

class WorkerSlot;

// Thread-safe.
class WorkerPool {
 public:
  struct Options {
    WorkerCommand command;
    int worker_count = 1;
    // Each worker in turn sees one of them; empty: as `command` says.
    std::vector<std::string> cuda_devices;
    // A worker that was asked to stop is killed after this.
    absl::Duration stop_patience = absl::Seconds(5);
    // The same for a job that was cancelled: whoever cancels wants the worker back, and a stage
    // that does not look up in time costs less than a fresh worker.
    absl::Duration cancel_patience = absl::Milliseconds(150);
    // A decoder cannot be asked to stop; beyond this its worker is killed and the input blamed.
    absl::Duration decode_patience = absl::Minutes(2);
    // A worker that has a job and gives no sign of life for so long is frozen: it is killed, which
    // costs the attempt.
    absl::Duration silence_patience = absl::Seconds(30);
    // Time for a worker to say hello.
    absl::Duration start_patience = absl::Seconds(60);
    // Time for the trial job of a worker whose predecessors have died.
    absl::Duration probe_patience = absl::Seconds(60);
  };

  WorkerPool(const Options& options, JobManager* manager);
  ~WorkerPool();  // as Stop(absl::Now())

  // Starts the threads; the workers come up in the background. `on_ready_change` is called after
  // each change of ready_count(), from any thread and from several at once, until Stop has
  // returned.
  void Start(std::function<void()> on_ready_change);
  // Lets running jobs finish until `deadline`, then gives them back. Once; joins the threads.
  void Stop(absl::Time deadline);
  // From another thread, moves the deadline of a Stop under way.
  void HurryUp(absl::Time deadline);

  // Estimates the cost of a job in a worker of its own; blocks for it. UNAVAILABLE when stopped.
  absl::StatusOr<amhex::v1::CostEstimate> Estimate(amhex::worker::RunJob order);

  int ready_count() const { return ready_count_.load(); }
  // Workers held back because they keep failing the trial job.
  int quarantined_count() const { return quarantined_count_.load(); }
  // The hello of the latest worker that came up, with the backends of all; empty before.
  amhex::worker::Hello hello() const;
  // The process ids of the workers that are up; for tests and logs.
  std::vector<pid_t> pids() const;

  const Options& options() const { return options_; }

 private:
  friend class WorkerSlot;

  const Options options_;
  JobManager* const manager_;
  void ChangeReadyCount(int change);
  void TakeHello(int worker, const amhex::worker::Hello& hello);
  void ChangeQuarantinedCount(int change);

  std::function<void()> on_ready_change_;
  mutable std::mutex mutex_;
  amhex::worker::Hello hello_;
  std::map<int, amhex::worker::Hello> hellos_;  // by the worker's number
  std::atomic<int> ready_count_{0};
  std::atomic<int> quarantined_count_{0};
  std::atomic<bool> stopping_{false};
  std::vector<std::unique_ptr<WorkerSlot>> slots_;
};

}  // namespace amhex::server
