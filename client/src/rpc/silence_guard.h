// Ends a call whose stream has fallen silent.
#pragma once

#include <grpcpp/client_context.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

namespace amhex::client {

// With the default of 45 s a chunk of 1 MiB may take 3 min: lines down to 47 kbit/s.
inline constexpr int kTransferSilenceFactor = 4;

// While it lives, cancels the call if Renew is not called for `longest`. A server that answers
// pings may still have forgotten a call; only who knows how often something must come can tell. The
// call's context must outlive it.
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

  // Something has come, or gone out.
  void Renew() {
    const std::lock_guard lock(mutex_);
    end_ = Clock::now() + longest_;
  }

  // How the call ended, whose status was `status`: UNAVAILABLE, worth another try, where this guard
  // ended it.
  absl::Status Verdict(const absl::Status& status) const {
    const std::lock_guard lock(mutex_);
    if (status.ok() || !has_cancelled_) return status;
    return absl::UnavailableError(
        absl::StrCat("nothing has moved for ", absl::FormatDuration(absl::FromChrono(longest_))));
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
