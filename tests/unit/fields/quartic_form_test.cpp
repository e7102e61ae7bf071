#include "fields/quartic_form.h"

#include <gtest/gtest.h>

#include <algorithm>
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

TEST(QuarticForm, OfAnAxisHasTheGradientOfItsFourthPower) {
  const Vec3d axis = Normalized(Vec3d{0.9, 0.3, -0.2});
  const Vec3d x{0.3, -0.7, 0.5};
  const Vec3d expected = axis * (4 * std::pow(Dot(axis, x), 3));
  EXPECT_LT(Norm(FormOfAxis(axis).Gradient(x) - expected), 1e-6);
}

double SumOverAxes(const QuarticForm& form, const Quaternion& frame) {
  double sum = 0;
  // P is homogeneous of degree four: P(x) = x . grad P(x) / 4.
  for (const Vec3d& axis : ToFrame(frame).axis) sum += Dot(axis, form.Gradient(axis)) / 4;
  return sum;
}

TEST(QuarticForm, NoRotationOfAFineGridBeatsTheNearestFrame) {
  QuarticForm sum = FormOfFrame(TurnAboutZ(0.1));
  sum.Add(FormOfFrame(Normalized(Quaternion{0.9, 0.2, 0.1, 0.3})), 1.0F);
  sum.Add(FormOfAxis(Normalized(Vec3d{0.1, 0.9, 0.4})), 0.5F);
  const double nearest = SumOverAxes(sum, NearestFrame(sum, TurnAboutZ(0.1), 60));
  constexpr int kSteps = 12;
  for (int i = 0; i < kSteps * kSteps * kSteps * kSteps; ++i) {
    Quaternion q;
    const auto at = [](int step) { return 2.0 * step / (kSteps - 1) - 1; };
    q.w = at(i % kSteps), q.x = at(i / kSteps % kSteps);
    q.y = at(i / kSteps / kSteps % kSteps), q.z = at(i / kSteps / kSteps / kSteps);
    EXPECT_LE(SumOverAxes(sum, Normalized(q)), nearest + 1e-6);
  }
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
