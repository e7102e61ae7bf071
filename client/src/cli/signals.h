// Ctrl-C and SIGTERM as a request that the main flow answers.
#pragma once

#include <atomic>
#include <thread>

#include "amhex/client.h"

namespace amhex::client {

// While alive, the first SIGINT or SIGTERM requests `interrupt`; the second ends the process at
// once with status 130. Make it before any other thread starts, as threads inherit what is blocked.
class SignalWatcher {
 public:
  explicit SignalWatcher(Interrupt* interrupt);
  ~SignalWatcher();

 private:
  void Run();

  Interrupt* interrupt_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace amhex::client
