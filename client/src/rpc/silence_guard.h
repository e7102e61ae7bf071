// Ends a call whose stream has fallen silent.
#pragma once

#include <grpcpp/client_context.h>

#include <algorithm>
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
// pings may still have forgotten a call; only who knows how often something must come can tell.
// Only time in which this process runs counts: one that was suspended from a terminal for minutes
// has missed nothing that does not wait for it. The call's context must outlive it.
class SilenceGuard {
 public:
  SilenceGuard(grpc::ClientContext* context, absl::Duration longest)
      : context_(context),
        longest_(absl::ToChronoMilliseconds(longest)),
        step_(std::min<Clock::duration>(kLongestStep, longest_ / kStepsAtLeast)),
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
    silent_ = -step_;  // the one under way will count as a whole
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
  static constexpr std::chrono::seconds kLongestStep{1};
  static constexpr int kStepsAtLeast = 8;

  void Wait() {
    std::unique_lock lock(mutex_);
    while (!done_) {
      if (silent_ >= longest_) {
        has_cancelled_ = true;
        context_->TryCancel();
        return;
      }
      const Clock::time_point start = Clock::now();
      changed_.wait_for(lock, step_);
      // A step that took far longer is one in which this process stood still.
      silent_ += std::min<Clock::duration>(Clock::now() - start, 2 * step_);
    }
  }

  grpc::ClientContext* const context_;
  const std::chrono::milliseconds longest_;
  const Clock::duration step_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Clock::duration silent_{0};
  bool done_ = false;
  bool has_cancelled_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace amhex::client
