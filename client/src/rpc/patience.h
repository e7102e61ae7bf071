// How long and how often a call that cannot get through is repeated.
#pragma once

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "amhex/client.h"

namespace amhex::client {

class Patience {
 public:
  // `interrupt` may be null.
  Patience(absl::Duration total, const Interrupt* interrupt)
      : total_(total), deadline_(absl::Now() + total), interrupt_(interrupt) {}

  // After a failure: waits and says whether to try again. Only UNAVAILABLE, ABORTED, calls
  // that the server cut off, and errors that come with a retry delay are worth it. False once the
  // time is up or the call interrupted.
  bool ShouldRetry(const absl::Status& failure);

  // Something got through: the time starts anew.
  void Renew();

 private:
  absl::Duration total_;
  absl::Time deadline_;
  absl::Duration next_wait_ = kFirstWait;
  const Interrupt* interrupt_;

  static constexpr absl::Duration kFirstWait = absl::Milliseconds(100);
};

}  // namespace amhex::client
