#pragma once

#include <atomic>
#include <map>
#include <thread>

namespace amhex::server {

// Finds out, while it lives, how much CPU time the busiest thread of this process takes. Where
// parts of a pipeline share cores, its rate is bound by their sum; where each has a core of its
// own, by the busiest. Threads are looked at every few milliseconds, so that what one does after
// the last look before its end is missed.
class BusiestThread {
 public:
  BusiestThread();
  ~BusiestThread();
  BusiestThread(const BusiestThread&) = delete;
  BusiestThread& operator=(const BusiestThread&) = delete;

  // Ends looking; CPU seconds of the busiest thread since construction.
  double Stop();

 private:
  struct Seconds {
    double first = 0;
    double last = 0;
  };

  void Look(bool is_first);

  std::map<int, Seconds> threads_;  // by thread id
  std::atomic<bool> stop_ = false;
  std::thread looking_;
};

}  // namespace amhex::server
