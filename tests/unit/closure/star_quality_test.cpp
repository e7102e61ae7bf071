// The law of judging no further than asked: what is judged short is not above what was enough.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "closure/star_geometry.h"

namespace amhex {
namespace {

TEST(StarQuality, IsWholeWhereItIsAboveWhatIsEnough) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto near = [&](double x, double y, double z) {
    return Vec3d{x + 0.4 * number(random), y + 0.4 * number(random), z + 0.4 * number(random)};
  };
  int whole_ones = 0, short_ones = 0;
  for (int round = 0; round < 500; ++round) {
    const std::vector<Vec3d> x = {near(0, 0, 0), near(1, 0, 0), near(1, 1, 0), near(0, 1, 0)};
    const Vec3d apex = near(0.5, 0.5, 0.8);
    for (const CellFace& face : {CellFace{4, {0, 1, 2, 3}}, CellFace{3, {0, 1, 2, -1}}}) {
      const double whole = StarQuality(face, apex, x);
      for (const double enough : {-0.3, 0.0, 0.2, 0.5}) {
        const double asked = StarQuality(face, apex, x, enough);
        if (whole > enough) {
          EXPECT_EQ(asked, whole);
          ++whole_ones;
        } else {
          EXPECT_LE(asked, enough);
          EXPECT_GE(asked, whole);
          short_ones += asked > whole ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(whole_ones, 500);
  EXPECT_GT(short_ones, 100);
}

}  // namespace
}  // namespace amhex
