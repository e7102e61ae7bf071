#include "worker_process.h"

#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <vector>

#include "status_macros.h"
#include "worker/worker_fd.h"

extern char** environ;

namespace amhex::server {
namespace {

// Frees posix_spawn's two option objects.
struct SpawnOptions {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;

  explicit SpawnOptions(int socket) {
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, socket, kWorkerFd);
    posix_spawn_file_actions_addclosefrom_np(&actions, kWorkerFd + 1);
    posix_spawnattr_init(&attributes);
    // Its own process group, so that a terminal's Ctrl-C reaches only the server, and none of the
    // server's blocked signals.
    sigset_t none;
    sigset_t all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(
        &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  }
  ~SpawnOptions() {
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  }
};

// This process's variables, and those of the command.
std::vector<std::string> Environment(const WorkerCommand& command) {
  const std::string visible = "CUDA_VISIBLE_DEVICES=";
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string text = *variable;
    const bool is_replaced = !command.cuda_device.empty() && text.starts_with(visible);
    if (!is_replaced) variables.push_back(text);
  }
  if (!command.cuda_device.empty()) variables.push_back(visible + command.cuda_device);
  return variables;
}

absl::StatusOr<pid_t> Spawn(const WorkerCommand& command, int socket) {
  SpawnOptions options(socket);
  std::string path = command.path;
  std::string flag = "--memory-limit-bytes";
  std::string value = std::to_string(command.memory_limit_bytes);
  std::array<char*, 4> arguments = {path.data(), flag.data(), value.data(), nullptr};
  std::vector<std::string> variables = Environment(command);
  std::vector<char*> environment;
  for (std::string& variable : variables) environment.push_back(variable.data());
  environment.push_back(nullptr);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, path.c_str(), &options.actions, &options.attributes,
                                arguments.data(), environment.data());
  if (error != 0) {
    return absl::UnavailableError("cannot start a worker: " +
                                  std::generic_category().message(error));
  }
  return pid;
}

}  // namespace

std::string WorkerExit::Description() const {
  if (signal == 0) return "exit code " + std::to_string(exit_code);
  return "signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
}

absl::StatusOr<std::unique_ptr<WorkerProcess>> WorkerProcess::Start(const WorkerCommand& command,
                                                                    absl::Duration patience) {
  std::array<int, 2> sockets;
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) != 0) {
    return absl::UnavailableError("cannot make a socket pair: " +
                                  std::generic_category().message(errno));
  }
  UniqueFd ours(sockets[0]);
  UniqueFd theirs(sockets[1]);
  AMHEX_ASSIGN_OR_RETURN(const pid_t pid, Spawn(command, theirs.get()));
  theirs.Reset();  // else the worker's end would never look closed from here
  std::unique_ptr<WorkerProcess> process(new WorkerProcess(pid, std::move(ours)));
  amhex::worker::FromWorker first;
  const auto outcome = process->channel_.Receive(&first, patience);
  if (!outcome.ok() || *outcome != FrameChannel::Outcome::kFrame || !first.has_hello()) {
    return absl::UnavailableError("a worker did not say hello");
  }
  process->hello_ = first.hello();
  return process;
}

WorkerProcess::~WorkerProcess() {
  Kill();
  Wait();
}

void WorkerProcess::Kill() {
  if (!reaped_) kill(pid_, SIGKILL);
}

WorkerExit WorkerProcess::Wait() {
  if (reaped_) return exit_;
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  reaped_ = true;
  if (WIFSIGNALED(status)) exit_.signal = WTERMSIG(status);
  if (WIFEXITED(status)) exit_.exit_code = WEXITSTATUS(status);
  return exit_;
}

}  // namespace amhex::server
