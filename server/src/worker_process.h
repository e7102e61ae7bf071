// One amhex-worker child process and the socket to it.
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "worker/frame_channel.h"
#include "worker/worker_protocol.pb.h"

namespace amhex::server {

struct WorkerCommand {
  std::string path;                // of the executable
  int64_t memory_limit_bytes = 0;  // 0: no bound
  std::string cuda_device = {};    // the one it sees, as CUDA_VISIBLE_DEVICES says; empty: all
};

// How a process ended.
struct WorkerExit {
  int signal = 0;  // 0: it exited by itself
  int exit_code = 0;
  std::string Description() const;  // e.g. "signal 9 (Killed)"
};

// Thread-compatible. The destructor kills the process and waits for it.
class WorkerProcess {
 public:
  // Starts the process and waits for its Hello, at most `patience`.
  static absl::StatusOr<std::unique_ptr<WorkerProcess>> Start(const WorkerCommand& command,
                                                              absl::Duration patience);
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  FrameChannel& channel() { return channel_; }
  const amhex::worker::Hello& hello() const { return hello_; }
  pid_t pid() const { return pid_; }

  void Kill();
  // Waits for the end; the process must be dying already.
  WorkerExit Wait();

 private:
  WorkerProcess(pid_t pid, UniqueFd socket) : pid_(pid), channel_(std::move(socket)) {}

  pid_t pid_;
  bool reaped_ = false;
  WorkerExit exit_;
  FrameChannel channel_;
  amhex::worker::Hello hello_;
};

}  // namespace amhex::server
