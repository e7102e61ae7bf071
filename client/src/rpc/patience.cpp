#include "rpc/patience.h"

#include <algorithm>

#include "rpc/status_convert.h"

namespace amhex::client {

bool Patience::MayPass(const absl::Status& failure) const {
  // A call that this side did not give up was cut off by a server that ends.
  const bool cut_off = absl::IsCancelled(failure) && !(interrupt_ && interrupt_->requested());
  return cut_off || absl::IsUnavailable(failure) || absl::IsAborted(failure) ||
         HasNoRoomNow(failure) || RetryDelayOf(failure);
}

bool Patience::ShouldRetry(const absl::Status& failure) {
  constexpr absl::Duration kLongestWait = absl::Seconds(5), kSlice = absl::Milliseconds(50);
  // Clients that failed together are not to come back together.
  constexpr double kMostSpread = 1.5;
  if (!MayPass(failure)) return false;
  if (!deadline_) deadline_ = absl::Now() + total_;
  const absl::Duration least = std::max(next_wait_, RetryDelayOf(failure).value_or(next_wait_));
  const double spread = std::uniform_real_distribution<double>(1.0, kMostSpread)(random_);
  const absl::Time until = absl::Now() + spread * least;
  next_wait_ = std::min(kLongestWait, 2 * next_wait_);
  if (until > *deadline_) return false;
  while (absl::Now() < until) {
    if (interrupt_ != nullptr && interrupt_->requested()) return false;
    absl::SleepFor(kSlice);
  }
  return true;
}

void Patience::Renew() {
  deadline_.reset();
  next_wait_ = kFirstWait;
}

}  // namespace amhex::client
