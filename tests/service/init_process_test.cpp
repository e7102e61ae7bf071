// The first process of a container: here one that inherits orphans, as process 1 does.
#include "init_process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "service_fixtures.h"

namespace amhex::server {
namespace {

constexpr int kDone = 7;
constexpr int kNotReaped = 8;

// The exit code, or -1 after death by a signal.
int Wait(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// Starts ServeUnderInit in a process of its own, which inherits the orphans below it.
pid_t StartInit(const std::function<int()>& serve) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  _exit(ServeUnderInit(serve));
}

// Waits for a signal that was blocked before; the others end the process.
int WaitForSignal(int wanted) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, wanted);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  int number = 0;
  sigwait(&signals, &number);
  return number;
}

TEST(InitProcess, ReturnsWhatTheServerReturned) {
  EXPECT_EQ(Wait(StartInit([] { return 0; })), 0);
  EXPECT_EQ(Wait(StartInit([] { return kDone; })), kDone);
}

TEST(InitProcess, TellsOfWhichSignalTheServerDied) {
  EXPECT_EQ(Wait(StartInit([] { return raise(SIGKILL); })), 128 + SIGKILL);
}

TEST(InitProcess, ReapsOrphansWhileTheServerRuns) {
  const auto serve = [] {
    int channel[2];
    if (pipe(channel) != 0) return kNotReaped;
    const pid_t parent = fork();
    if (parent == 0) {
      const pid_t orphan = fork();
      if (orphan == 0) _exit(0);
      _exit(write(channel[1], &orphan, sizeof(orphan)) == sizeof(orphan) ? 0 : 1);
    }
    pid_t orphan = 0;
    if (read(channel[0], &orphan, sizeof(orphan)) != sizeof(orphan)) return kNotReaped;
    Wait(parent);
    // A zombie can still be sent signals.
    return Eventually([orphan] { return kill(orphan, 0) != 0; }) ? kDone : kNotReaped;
  };
  EXPECT_EQ(Wait(StartInit(serve)), kDone);
}

TEST(InitProcess, PassesSignalsOn) {
  TemporaryFolder folder;
  const std::string ready = folder / "ready";
  const pid_t init = StartInit([&ready] {
    sigset_t term;
    sigemptyset(&term);
    sigaddset(&term, SIGTERM);
    sigprocmask(SIG_BLOCK, &term, nullptr);
    std::ofstream(ready) << "ready" << std::endl;
    return WaitForSignal(SIGTERM) == SIGTERM ? kDone : kNotReaped;
  });
  ASSERT_TRUE(Eventually([&ready] { return std::ifstream(ready).good(); }));
  kill(init, SIGTERM);
  EXPECT_EQ(Wait(init), kDone);
}

}  // namespace
}  // namespace amhex::server
