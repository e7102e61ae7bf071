#include "worker/remaining_time.h"

#include <gtest/gtest.h>

namespace amhex::server {
namespace {

TEST(RemainingTime, BeginsWithWhatIsExpectedAndEndsWithNothing) {
  const RemainingTime time(100);
  EXPECT_DOUBLE_EQ(time.Seconds(Stage::kCheckInput, 0, 0), 100);
  EXPECT_NEAR(time.Seconds(Stage::kValidate, 1, 70), 0, 1e-9);
}

TEST(RemainingTime, FallsWhileARunKeepsItsPace) {
  const RemainingTime time(100);
  double before = 101;
  for (int step = 0; step <= 10; ++step) {
    const double now = time.Seconds(Stage::kPopulate, 0.1 * step, 7 + 4.3 * step);
    EXPECT_LT(now, before) << step;
    before = now;
  }
}

TEST(RemainingTime, LearnsFromARunThatIsTenTimesSlowerThanExpected) {
  const RemainingTime time(100);
  // Half done after 500 s: about as long again.
  EXPECT_NEAR(time.Seconds(Stage::kPopulate, 1, 500), 500, 60);
}

TEST(RemainingTime, IsNeverNegativeWhateverIsTold) {
  const RemainingTime time(0);
  for (const double fraction : {-1.0, 0.0, 0.5, 2.0}) {
    for (int stage = 0; stage <= static_cast<int>(Stage::kValidate); ++stage) {
      EXPECT_GE(time.Seconds(static_cast<Stage>(stage), fraction, 1e6), 0);
    }
  }
}

}  // namespace
}  // namespace amhex::server
