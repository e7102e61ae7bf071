#include "relax/regularity_weight.h"

#include <gtest/gtest.h>

namespace amhex {
namespace {

TEST(RegularityWeight, IsZeroInTheFirstHalfPeaksAtThreeQuartersAndEndsAtZero) {
  for (const double p : {0.0, 0.1, 0.3, 0.5}) EXPECT_EQ(RegularityWeight(p), 0.0);
  EXPECT_NEAR(RegularityWeight(0.75), 1.0, 1e-12);
  EXPECT_NEAR(RegularityWeight(1.0), 0.0, 1e-12);
}

TEST(RegularityWeight, RisesToItsPeakAndFallsSymmetrically) {
  double before = 0;
  for (double p = 0.51; p <= 0.75; p += 0.01) {
    EXPECT_GT(RegularityWeight(p), before);
    EXPECT_NEAR(RegularityWeight(p), RegularityWeight(1.5 - p), 1e-12);
    before = RegularityWeight(p);
  }
}

}  // namespace
}  // namespace amhex
