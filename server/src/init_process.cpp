#include "init_process.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <optional>

#include "logging.h"

namespace amhex::server {
namespace {

constexpr int kDiedOfSignal = 128;  // as shells report it

// Reaps whatever has ended; how `server` has, if it is among them.
std::optional<int> ReapAll(pid_t server) {
  std::optional<int> exit_code;
  int status = 0;
  while (true) {
    const pid_t ended = waitpid(-1, &status, WNOHANG);
    if (ended <= 0) return exit_code;
    if (ended != server) continue;
    exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : kDiedOfSignal + WTERMSIG(status);
  }
}

}  // namespace

int ServeUnderInit(const std::function<int()>& serve) {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  const pid_t server = fork();
  if (server < 0) {
    LogError("start_failed", {{"message", "cannot make a process"}});
    return EXIT_FAILURE;
  }
  if (server == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return serve();
  }
  while (true) {
    int number = 0;
    sigwait(&all, &number);
    if (number != SIGCHLD) {
      kill(server, number);
    } else if (const auto exit_code = ReapAll(server)) {
      return *exit_code;
    }
  }
}

}  // namespace amhex::server
