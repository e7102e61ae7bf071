#include "base/quat.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "base/counter_rng.h"
#include "orientation/frames.h"

namespace amhex {
namespace {

Quatf RandomRotation(uint64_t index) {
  const auto component = [&](uint64_t i) {
    return static_cast<float>(2 * RandomUnit(3, RandomStream::kKnnStart, 4 * index + i) - 1);
  };
  return Normalized(Quatf{component(0), component(1), component(2), component(3)});
}

TEST(Quat, ProductAndAxesEqualEigens) {
  for (uint64_t i = 0; i < 100; ++i) {
    const Quatf a = RandomRotation(2 * i), b = RandomRotation(2 * i + 1);
    const Eigen::Quaternionf expected =
        Eigen::Quaternionf(a.w, a.x, a.y, a.z) * Eigen::Quaternionf(b.w, b.x, b.y, b.z);
    const Quatf product = a * b;
    EXPECT_NEAR(product.w, expected.w(), 1e-6);
    EXPECT_NEAR(product.x, expected.x(), 1e-6);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3f column = expected.toRotationMatrix().col(axis);
      for (int row = 0; row < 3; ++row) {
        EXPECT_NEAR(AxisOf(product, axis)[row], column(row), 1e-5);
      }
    }
  }
}

TEST(Quat, DirectionsComeInOppositePairsMinusFirst) {
  const Quatf q = RandomRotation(9);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(DirectionOf(q, 2 * axis + 1), AxisOf(q, axis));
    EXPECT_EQ(DirectionOf(q, 2 * axis), -AxisOf(q, axis));
  }
}

TEST(Quat, FramesSurviveTheWayToQuaternionsAndBack) {
  for (uint64_t i = 0; i < 100; ++i) {
    const AxisFrame frame = FrameFromQuat(RandomRotation(i));
    const AxisFrame again = FrameFromQuat(QuatFromFrame(frame));
    for (size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(Norm(frame.axis[axis] - again.axis[axis]), 0, 1e-6);
    }
  }
}

}  // namespace
}  // namespace amhex
