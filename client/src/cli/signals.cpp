#include "cli/signals.h"

#include <unistd.h>

#include <csignal>
#include <ctime>

#include "cli/exit_codes.h"

namespace amhex::client {
namespace {

sigset_t WatchedSignals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

SignalWatcher::SignalWatcher(Interrupt* interrupt) : interrupt_(interrupt) {
  const sigset_t set = WatchedSignals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe shows as a write error
  thread_ = std::thread([this] { Run(); });
}

SignalWatcher::~SignalWatcher() {
  ends_ = true;
  thread_.join();
}

void SignalWatcher::Run() {
  const sigset_t set = WatchedSignals();
  constexpr timespec kSlice = {0, 100'000'000};
  while (!ends_) {
    if (sigtimedwait(&set, nullptr, &kSlice) < 0) continue;
    if (interrupt_->requested()) _exit(kExitCancelled);
    interrupt_->Request();
  }
}

}  // namespace amhex::client
