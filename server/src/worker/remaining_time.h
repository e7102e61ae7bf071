// Estimates how long a run will still take.
#pragma once

#include "amhex/run_context.h"

namespace amhex::server {

// Starts from what runs of the size are expected to cost and learns from how this one goes.
class RemainingTime {
 public:
  // `expected_seconds` of the whole run; 0: nothing is expected, only what goes on counts.
  explicit RemainingTime(double expected_seconds);

  // At `fraction` in [0, 1] of `stage`, after `elapsed` seconds of the run. Never negative, 0 at
  // the last stage's end.
  double Seconds(Stage stage, double fraction, double elapsed) const;

 private:
  const double expected_seconds_;
};

}  // namespace amhex::server
