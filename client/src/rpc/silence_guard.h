// Ends a call whose stream has fallen silent.
#pragma once

#include <grpcpp/client_context.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "absl/time/time.h"

namespace amhex::client {

// While it lives, cancels the call if Renew is not called for `longest`. A connection that answers
// pings may still have lost a frame on its way, or its reader's wake-up; only who knows how often
// frames come can tell. The call's context must outlive it.
class SilenceGuard {
 public:
  SilenceGuard(grpc::ClientContext* context, absl::Duration longest)
      : context_(context),
        longest_(absl::ToChronoMilliseconds(longest)),
        end_(Clock::now() + longest_),
        thread_([this] { Wait(); }) {}
  ~SilenceGuard() {
    {
      const std::lock_guard lock(mutex_);
      done_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  SilenceGuard(const SilenceGuard&) = delete;
  SilenceGuard& operator=(const SilenceGuard&) = delete;

  // Something has come.
  void Renew() {
    const std::lock_guard lock(mutex_);
    end_ = Clock::now() + longest_;
  }

  bool has_cancelled() const {
    const std::lock_guard lock(mutex_);
    return has_cancelled_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  void Wait() {
    std::unique_lock lock(mutex_);
    while (!done_) {
      if (Clock::now() >= end_) {
        has_cancelled_ = true;
        context_->TryCancel();
        return;
      }
      changed_.wait_until(lock, end_);
    }
  }

  grpc::ClientContext* const context_;
  const std::chrono::milliseconds longest_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Clock::time_point end_;
  bool done_ = false;
  bool has_cancelled_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace amhex::client
