// The 24 rotations that carry the coordinate axes to themselves, and frames that match up to them.
//
// A frame names three axes only up to order and sign. Two neighbouring frames q_i and q_j are
// compared after the rotation G of the group that brings q_j nearest to q_i: M_j = M_i G for equal
// frames, so G carries lattice coordinates of j into those of i.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/vec3.h"
#include "fields/frame_math.h"
#include "fields/match_code.h"
#include "relax/sites.h"

namespace amhex::fields {

inline constexpr int kRotationCount = 24;

// (G v)[k] = sign[k] * v[source[k]].
struct AxisRotation {
  std::array<int8_t, 3> source{0, 1, 2};
  std::array<int8_t, 3> sign{1, 1, 1};

  template <class T>
  Vec3<T> Apply(const Vec3<T>& v) const {
    return {sign[0] * v[source[0]], sign[1] * v[source[1]], sign[2] * v[source[2]]};
  }
  template <class T>
  Vec3<T> ApplyInverse(const Vec3<T>& v) const {
    Vec3<T> r;
    for (int k = 0; k < 3; ++k) r[source[k]] = sign[k] * v[k];
    return r;
  }
  bool operator==(const AxisRotation&) const = default;
};

// a after b.
AxisRotation Compose(const AxisRotation& a, const AxisRotation& b);

// Indexed by the codes that NearestRotation returns; code 0 is the identity. Made before main.
extern const std::array<AxisRotation, kRotationCount> kAxisRotations;
extern const std::array<uint8_t, kRotationCount> kInverseCodes;

// a + b * weight, with b's sign chosen so that it lies on a's side.
Quaternion AddAligned(const Quaternion& a, const Quaternion& b, double weight);

// q_j with its axes renamed so that it lies nearest to `reference` (any positive length).
Quaternion Matched(const Quaternion& reference, const Quaternion& q);

// `q` turned by the least angle that puts its nearest axis (either sign) on `normal` (unit).
Quaternion AlignedToNormal(const Quaternion& q, const Vec3d& normal);

}  // namespace amhex::fields
