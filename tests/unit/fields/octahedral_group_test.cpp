#include "fields/octahedral_group.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace amhex::fields {
namespace {

// Unit quaternions spread over all rotations.
std::vector<Quaternion> SampleRotations() {
  std::vector<Quaternion> samples;
  for (int i = 0; i < 500; ++i) {
    samples.push_back(
        Normalized(Quaternion{std::sin(1.0 + 12.9898 * i), std::sin(2.0 + 78.233 * i),
                              std::sin(3.0 + 37.719 * i), std::sin(4.0 + 4.581 * i)}));
  }
  return samples;
}

double LargestDifference(const AxisFrame& a, const AxisFrame& b) {
  double largest = 0;
  for (int k = 0; k < 3; ++k) largest = std::max(largest, Norm(a.axis[k] - b.axis[k]));
  return largest;
}

TEST(OctahedralGroup, HasTwentyFourDifferentRotations) {
  std::set<std::array<int, 6>> seen;
  for (const AxisRotation& r : kAxisRotations) {
    seen.insert({r.source[0], r.source[1], r.source[2], r.sign[0], r.sign[1], r.sign[2]});
  }
  EXPECT_EQ(seen.size(), 24U);
  EXPECT_EQ(kAxisRotations[0], AxisRotation{});
}

TEST(OctahedralGroup, ComposingWithTheInverseGivesTheIdentity) {
  for (int code = 0; code < kRotationCount; ++code) {
    EXPECT_EQ(Compose(kAxisRotations[code], kAxisRotations[kInverseCodes[code]]), AxisRotation{});
    const Vec3d v{1, 2, 3};
    EXPECT_EQ(kAxisRotations[code].ApplyInverse(kAxisRotations[code].Apply(v)), v);
  }
}

TEST(OctahedralGroup, MatchedFramesNameTheSameAxesAndLieNearest) {
  const std::vector<Quaternion> samples = SampleRotations();
  for (size_t i = 1; i < samples.size(); ++i) {
    const Quaternion& reference = samples[i - 1];
    const Quaternion matched = Matched(reference, samples[i]);
    // Within 62.8 degrees of the reference, the largest distance to the nearest of the 24.
    EXPECT_GT(std::abs(Dot(reference, matched)), 0.853);
    EXPECT_EQ(MatchCode(reference, matched), 0);
    for (const Vec3d& axis : ToFrame(matched).axis) {
      double best = 0;
      for (const Vec3d& own : ToFrame(samples[i]).axis) {
        best = std::max(best, std::abs(Dot(axis, own)));
      }
      EXPECT_NEAR(best, 1, 1e-12);
    }
  }
}

TEST(OctahedralGroup, TheMatchCodeCarriesCoordinatesFromOneFrameToTheOther) {
  const Quaternion frame = SampleRotations()[7];
  for (int code = 0; code < kRotationCount; ++code) {
    // Frame j with M_j = M_i G: the same vector has coordinates x_i = G x_j.
    const AxisRotation& rotation = kAxisRotations[code];
    AxisFrame other;
    for (int row = 0; row < 3; ++row) {
      other.axis[rotation.source[row]] = ToFrame(frame).axis[row] * rotation.sign[row];
    }
    EXPECT_EQ(MatchCode(frame, FromFrame(other)), code);
  }
}

TEST(OctahedralGroup, FramesAndQuaternionsConvertBothWays) {
  for (const Quaternion& q : SampleRotations()) {
    EXPECT_LT(LargestDifference(ToFrame(FromFrame(ToFrame(q))), ToFrame(q)), 1e-12);
  }
}

TEST(OctahedralGroup, AligningPutsAnAxisOnTheNormalWithTheLeastTurn) {
  const std::vector<Quaternion> samples = SampleRotations();
  for (size_t i = 1; i < samples.size(); ++i) {
    const Vec3d normal = ToFrame(samples[i - 1]).axis[0];
    double nearest = 0, aligned = 0;
    for (const Vec3d& axis : ToFrame(samples[i]).axis) {
      nearest = std::max(nearest, std::abs(Dot(axis, normal)));
    }
    const Quaternion turned = AlignedToNormal(samples[i], normal);
    for (const Vec3d& axis : ToFrame(turned).axis) {
      aligned = std::max(aligned, std::abs(Dot(axis, normal)));
    }
    EXPECT_NEAR(aligned, 1, 1e-12);
    const double half_angle = std::acos(std::min(1.0, std::abs(Dot(turned, samples[i]))));
    EXPECT_NEAR(2 * half_angle, std::acos(std::min(1.0, nearest)), 1e-6);
  }
}

}  // namespace
}  // namespace amhex::fields
