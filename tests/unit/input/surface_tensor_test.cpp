#include "input/surface_tensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace amhex {
namespace {

// a a^T times `first` plus b b^T times `second`.
SymmetricTensor TensorOf(const Vec3d& a, double first, const Vec3d& b, double second) {
  const auto entry = [&](int i, int j) { return first * a[i] * a[j] + second * b[i] * b[j]; };
  return {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(2, 0)};
}

TEST(PrincipalDirections, AreThoseThatATensorWasMadeOf) {
  const Vec3d normal = Normalized(Vec3d{1, -2, 0.5});
  const Vec3d u = AnyTangent(normal), v = Cross(normal, u);
  constexpr int kSteps = 360;
  for (int step = 0; step < kSteps; ++step) {
    const double angle = 2 * std::numbers::pi * step / kSteps;
    const Vec3d a = u * std::cos(angle) + v * std::sin(angle);
    for (const double second : {-1.5, -0.2, 0.0, 1.9}) {
      const auto found = PrincipalDirectionsOf(TensorOf(a, 2, Cross(normal, a), second), normal);
      EXPECT_NEAR(std::abs(Dot(found.largest, a)), 1, 1e-12) << angle << " " << second;
      EXPECT_NEAR(Norm(found.largest), 1, 1e-14);
      EXPECT_NEAR(found.curvature_max, 2, 1e-12);
      EXPECT_NEAR(found.curvature_min, second, 1e-12);
    }
  }
}

TEST(PrincipalDirections, OfATensorThatIsAlikeAllAroundAreUnitTangents) {
  const Vec3d normal{0, 0, 1};
  for (const double all : {0.0, 1.0, -3.0}) {
    const auto found = PrincipalDirectionsOf({all, all, all, 0, 0, 0}, normal);
    EXPECT_NEAR(Norm(found.largest), 1, 1e-14);
    EXPECT_NEAR(Dot(found.largest, normal), 0, 1e-14);
    EXPECT_NEAR(found.curvature_max, all, 1e-14);
  }
}

}  // namespace
}  // namespace amhex
