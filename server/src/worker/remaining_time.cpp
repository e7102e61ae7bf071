#include "worker/remaining_time.h"

#include <algorithm>
#include <array>

namespace amhex::server {
namespace {

// Shares of the stages in a run's time, in their order: means over the runs in docs/results.md.
constexpr std::array<double, 10> kShares = {0.06,  0.01,  0.43, 0.01, 0.02,
                                            0.005, 0.005, 0.13, 0.31, 0.02};
// How far a run must have come for its own pace to count as much as the expected one.
constexpr double kLearningShare = 0.05;
// Where nothing is expected.
constexpr double kDefaultSeconds = 10;

}  // namespace

RemainingTime::RemainingTime(double expected_seconds)
    : expected_seconds_(expected_seconds > 0 ? expected_seconds : kDefaultSeconds) {}

double RemainingTime::Seconds(Stage stage, double fraction, double elapsed) const {
  const auto number = std::min(static_cast<size_t>(stage), kShares.size());
  double done = 0;
  for (size_t i = 0; i < number; ++i) done += kShares[i];
  if (number < kShares.size()) done += kShares[number] * std::clamp(fraction, 0.0, 1.0);
  const double left = std::max(0.0, 1 - done);
  const double pace = (elapsed / expected_seconds_ + kLearningShare) / (done + kLearningShare);
  return left * expected_seconds_ * pace;
}

}  // namespace amhex::server
