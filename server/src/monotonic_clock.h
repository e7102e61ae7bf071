// The clock for waiting and for measuring. Nobody sets it, unlike the clock of the calendar, which
// jumps when it is corrected: a wait must not end an hour early for that, nor an hour late. It
// stands still while the machine sleeps.
#pragma once

#include <chrono>

#include "absl/time/time.h"

namespace amhex::server {

// Good for differences only.
inline absl::Time MonotonicNow() {
  return absl::UnixEpoch() + absl::FromChrono(std::chrono::steady_clock::now().time_since_epoch());
}

}  // namespace amhex::server
