#include "fields/quartic_form.h"

#include <gtest/gtest.h>

#include <cmath>

namespace amhex::fields {
namespace {

Quaternion TurnAboutZ(double radians) {
  return {std::cos(radians / 2), 0, 0, std::sin(radians / 2)};
}

double AngleBetween(const Quaternion& a, const Quaternion& b) {
  return 2 * std::acos(std::min(1.0, std::abs(Dot(a, Matched(a, b)))));
}

TEST(QuarticForm, DoesNotDependOnHowTheAxesAreNamed) {
  const Quaternion frame = Normalized(Quaternion{0.8, 0.3, -0.4, 0.2});
  const QuarticForm form = FormOfFrame(frame);
  // Quarter turns about its own axes.
  for (const Quaternion& naming : {Quaternion{1, 1, 0, 0}, {1, 0, -1, 0}, {1, 1, 1, -1}}) {
    const QuarticForm renamed = FormOfFrame(Multiply(frame, Normalized(naming)));
    for (int k = 0; k < 15; ++k) {
      EXPECT_NEAR(renamed.coefficients[k], form.coefficients[k], 1e-6);
    }
  }
}

TEST(QuarticForm, HasTheGradientOfItsSumOfFourthPowers) {
  const Quaternion frame = Normalized(Quaternion{0.8, 0.3, -0.4, 0.2});
  const Vec3d x{0.3, -0.7, 0.5};
  Vec3d expected;
  for (const Vec3d& axis : ToFrame(frame).axis) expected += axis * (4 * std::pow(Dot(axis, x), 3));
  EXPECT_LT(Norm(FormOfFrame(frame).Gradient(x) - expected), 1e-5);
}

TEST(QuarticForm, TheNearestFrameOfOneFrameIsThatFrame) {
  const Quaternion frame = Normalized(Quaternion{0.8, 0.3, -0.4, 0.2});
  const Quaternion start = Multiply(TurnAboutZ(0.3), frame);
  EXPECT_LT(AngleBetween(NearestFrame(FormOfFrame(frame), start, 4), frame), 1e-5);
}

TEST(QuarticForm, TheNearestFrameOfTwoLiesHalfWayBetweenThem) {
  QuarticForm sum = FormOfFrame(TurnAboutZ(0.1));
  sum.Add(FormOfFrame(TurnAboutZ(0.5)), 1.0F);
  EXPECT_LT(AngleBetween(NearestFrame(sum, TurnAboutZ(0.1), 20), TurnAboutZ(0.3)), 1e-4);
}

TEST(QuarticForm, WithoutPreferenceTheStartIsKept) {
  const Quaternion start = TurnAboutZ(0.2);
  EXPECT_EQ(Dot(NearestFrame(QuarticForm{}, start, 3), start), 1);
}

}  // namespace
}  // namespace amhex::fields
