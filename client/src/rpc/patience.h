// How long and how often a call that cannot get through is repeated.
#pragma once

#include <optional>
#include <random>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "amhex/client.h"

namespace amhex::client {

class Patience {
 public:
  // `interrupt` may be null.
  Patience(absl::Duration total, const Interrupt* interrupt)
      : total_(total), interrupt_(interrupt) {}

  // Whether a failure may pass: UNAVAILABLE, ABORTED, calls that the server cut off or had no room
  // for, and errors that come with a retry delay.
  bool MayPass(const absl::Status& failure) const;

  // After a failure: waits and says whether to try again. False if it cannot pass, once the time
  // since the first failure is up or the call interrupted.
  bool ShouldRetry(const absl::Status& failure);

  // Something got through: the next failure is the first one.
  void Renew();

 private:
  absl::Duration total_;
  // From the first failure on: a process that was suspended meanwhile still gets its time to try.
  std::optional<absl::Time> deadline_;
  absl::Duration next_wait_ = kFirstWait;
  const Interrupt* interrupt_;
  std::minstd_rand random_{std::random_device()()};

  static constexpr absl::Duration kFirstWait = absl::Milliseconds(100);
};

}  // namespace amhex::client
