#include "orientation/octahedral_match.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/counter_rng.h"

namespace amhex {
namespace {

Quatf RandomRotation(uint64_t index) {
  const auto component = [&](uint64_t i) {
    return static_cast<float>(2 * RandomUnit(11, RandomStream::kKnnStart, 4 * index + i) - 1);
  };
  return Normalized(Quatf{component(0), component(1), component(2), component(3)});
}

// All 24 by closure under quarter turns about x and y.
std::vector<Quatf> CubeRotations() {
  const Quatf turns[2] = {{kHalfSquareRoot, kHalfSquareRoot, 0, 0},
                          {kHalfSquareRoot, 0, kHalfSquareRoot, 0}};
  std::vector<Quatf> found = {Quatf{}};
  for (size_t i = 0; i < found.size(); ++i) {
    for (const Quatf& turn : turns) {
      const Quatf next = Normalized(turn * found[i]);
      bool is_known = false;
      for (const Quatf& q : found) is_known |= std::abs(Dot(q, next)) > 0.999f;
      if (!is_known) found.push_back(next);
    }
  }
  return found;
}

TEST(OctahedralMatch, EqualsTheBestOfAll24Rotations) {
  const std::vector<Quatf> rotations = CubeRotations();
  ASSERT_EQ(rotations.size(), 24u);
  for (uint64_t i = 0; i < 500; ++i) {
    const Quatf reference = RandomRotation(2 * i), q = RandomRotation(2 * i + 1);
    float best = 0;
    for (const Quatf& g : rotations) best = std::fmax(best, std::abs(Dot(reference, q * g)));
    EXPECT_NEAR(Dot(reference, MatchTo(reference, q)), best, 1e-5) << i;
  }
}

TEST(OctahedralMatch, DoesNotDependOnAxisPermutationsOrSigns) {
  const std::vector<Quatf> rotations = CubeRotations();
  for (uint64_t i = 0; i < 50; ++i) {
    const Quatf reference = RandomRotation(2 * i), q = RandomRotation(2 * i + 1);
    const Quatf matched = MatchTo(reference, q);
    for (const Quatf& g : rotations) {
      EXPECT_NEAR(Dot(MatchTo(reference, q * g), matched), 1, 1e-5);
      EXPECT_NEAR(Dot(MatchTo(reference, -(q * g)), matched), 1, 1e-5);
    }
  }
}

TEST(OctahedralMatch, TurnsTheNearestAxisOntoTheNormalAndNoFarther) {
  for (uint64_t i = 0; i < 200; ++i) {
    const Quatf q = RandomRotation(2 * i);
    const Vec3f normal = AxisOf(RandomRotation(2 * i + 1), 0);
    const Quatf turned = TurnNearestAxisTo(q, normal);
    float before = 0, after = 0;
    for (int axis = 0; axis < 3; ++axis) {
      before = std::fmax(before, std::abs(Dot(AxisOf(q, axis), normal)));
      after = std::fmax(after, std::abs(Dot(AxisOf(turned, axis), normal)));
    }
    EXPECT_NEAR(after, 1, 1e-5);
    // The angle of the turn is the angle between the nearest axis and the normal.
    const float half_cosine = std::fmin(1.0f, std::abs(Dot(q, turned)));
    EXPECT_NEAR(2 * half_cosine * half_cosine - 1, before, 1e-4);
  }
}

}  // namespace
}  // namespace amhex
