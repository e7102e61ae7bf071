// Lanes are never passed by a call here (base/vector_lanes.h).
#pragma GCC diagnostic ignored "-Wpsabi"
#include "fields/quartic_form.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/counter_rng.h"
#include "fields/balanced_frame.h"
#include "fields/frame_batch.h"
#include "fields/octahedral_group.h"

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

TEST(OutOfBalance, LeavesFramesThatFollowTheirNormalOrMoveByThemselves) {
  const Quaternion frame = Normalized(Quaternion{0.8, 0.3, -0.4, 0.2});
  const AxisFrame axes = ToFrame(frame);
  for (const Vec3d& normal :
       {axes.axis[0], axes.axis[2], Normalized(axes.axis[0] + axes.axis[1] * 0.9)}) {
    const Quaternion same = OutOfBalance(FormOfAxis(normal), frame);
    EXPECT_EQ(AngleBetween(same, frame), AngleBetween(frame, frame));
  }
}

TEST(OutOfBalance, FindsTheWayToNormalsBetweenTheAxes) {
  const Quaternion frame = Normalized(Quaternion{0.8, 0.3, -0.4, 0.2});
  const auto& [a, b, c] = ToFrame(frame).axis;
  for (const Vec3d& normal : {a + b, a - b, b + c, c - b, a + c, a - c, a + b + c, a - b + c}) {
    QuarticForm form = FormOfAxis(Normalized(normal));
    const Quaternion turned = OutOfBalance(form, frame);
    form.Add(FormOfFrame(frame), 0.05F);  // neighbours, which alone hold the frame as it is
    EXPECT_LT(SumOverAxes(form, NearestFrame(form, frame, 3)), 0.7);
    EXPECT_GT(SumOverAxes(form, NearestFrame(form, turned, 12)), 1.0);
  }
}

TEST(QuarticForm, ABatchGivesTheFramesOfItsFormsOneByOne) {
  uint64_t index = 0;
  const auto random_frame = [&index] {
    const auto part = [&index] { return RandomUnit(3, RandomStream::kSampleOrder, index++) - 0.5; };
    return Normalized(Quaternion{part(), part(), part(), part()});
  };
  for (int round = 0; round < 50; ++round) {
    FrameBatch batch;
    for (size_t lane = 0; lane < kLanes; ++lane) {
      batch.frames[lane] = random_frame();
      // Some agree, some hardly, one has no preference at all.
      for (size_t k = 0; k < lane; ++k) batch.forms[lane].Add(FormOfFrame(random_frame()), 1.0F);
    }
    const FrameBatch start = batch;
    FindNearestFrames(2, &batch);
    for (size_t lane = 0; lane < kLanes; ++lane) {
      const Quaternion alone = NearestFrame(start.forms[lane], start.frames[lane], 2);
      EXPECT_EQ(batch.frames[lane].w, alone.w);
      EXPECT_EQ(batch.frames[lane].x, alone.x);
      EXPECT_EQ(batch.frames[lane].y, alone.y);
      EXPECT_EQ(batch.frames[lane].z, alone.z);
    }
  }
}

TEST(QuarticForm, WithoutPreferenceTheStartIsKept) {
  const Quaternion start = TurnAboutZ(0.2);
  EXPECT_EQ(Dot(NearestFrame(QuarticForm{}, start, 3), start), 1);
}

}  // namespace
}  // namespace amhex::fields
