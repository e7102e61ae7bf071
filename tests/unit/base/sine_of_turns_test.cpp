#include "base/sine_of_turns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace amhex {
namespace {

TEST(SineOfTurns, IsTheSineToTheLastBits) {
  constexpr double kError = 3e-16;
  constexpr int kParts = 10'000;
  for (int part = 0; part <= kParts; ++part) {
    const double share = static_cast<double>(part) / kParts;
    const CosineAndSine turn = OfTurns(share);
    // The library's own error, of the product with pi, grows with the angle.
    ASSERT_NEAR(turn.cosine, std::cos(2 * std::numbers::pi * share), 3 * kError) << share;
    ASSERT_NEAR(turn.sine, std::sin(2 * std::numbers::pi * share), 3 * kError) << share;
    ASSERT_NEAR(turn.cosine * turn.cosine + turn.sine * turn.sine, 1, 2 * kError) << share;
    const double small = share / 8;  // where the product is as good as exact
    ASSERT_NEAR(OfTurns(small).sine, std::sin(2 * std::numbers::pi * small), kError) << small;
    ASSERT_NEAR(OfTurns(small).cosine, std::cos(2 * std::numbers::pi * small), kError) << small;
  }
}

TEST(SineOfTurns, RepeatsWithEveryTurnAndIsExactAtQuarters) {
  for (const double whole : {-3.0, -1.0, 1.0, 7.0, 1048576.0}) {
    for (double share = -0.5; share <= 0.5; share += 1.0 / 1024) {
      EXPECT_EQ(OfTurns(whole + share).cosine, OfTurns(share).cosine) << whole << " " << share;
      EXPECT_EQ(OfTurns(whole + share).sine, OfTurns(share).sine) << whole << " " << share;
    }
    EXPECT_EQ(OfTurns(whole).cosine, 1);
    EXPECT_EQ(OfTurns(whole + 0.25).sine, 1);
    EXPECT_EQ(OfTurns(whole + 0.5).cosine, -1);
    EXPECT_EQ(OfTurns(whole - 0.25).sine, -1);
    EXPECT_EQ(OfTurns(whole + 0.5).sine, 0);
    EXPECT_EQ(OfTurns(whole + 0.25).cosine, 0);
  }
}

TEST(SineOfTurns, OfWhatIsNoNumberOrHasNoEndIsNone) {
  for (const double none :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(OfTurns(none).cosine));
    EXPECT_TRUE(std::isnan(OfTurns(-none).sine));
  }
}

}  // namespace
}  // namespace amhex
