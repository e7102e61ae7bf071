#include "rpc/patience.h"

#include <algorithm>

#include "rpc/status_convert.h"

namespace amhex::client {

bool Patience::ShouldRetry(const absl::Status& failure) {
  constexpr absl::Duration kLongestWait = absl::Seconds(5), kSlice = absl::Milliseconds(50);
  const std::optional<absl::Duration> advised = RetryDelayOf(failure);
  // A call that this side did not give up was cut off by a server that ends.
  const bool cut_off = absl::IsCancelled(failure) && !(interrupt_ && interrupt_->requested());
  if (!advised && !cut_off && !absl::IsUnavailable(failure) && !absl::IsAborted(failure)) {
    return false;
  }
  const absl::Time until = absl::Now() + std::max(next_wait_, advised.value_or(next_wait_));
  next_wait_ = std::min(kLongestWait, 2 * next_wait_);
  if (until > deadline_) return false;
  while (absl::Now() < until) {
    if (interrupt_ != nullptr && interrupt_->requested()) return false;
    absl::SleepFor(kSlice);
  }
  return true;
}

void Patience::Renew() {
  deadline_ = absl::Now() + total_;
  next_wait_ = kFirstWait;
}

}  // namespace amhex::client
