// Frames up to the 24 rotations of the cube: the invariance to axis permutations of section 4.3.
#pragma once

#include "base/quat.h"

namespace amhex {

inline constexpr float kHalfSquareRoot = 0.70710678118654752f;

// The rotation of the cube closest to `relative` (which need not have unit length).
//
// The 24 are, as quaternions up to sign: one component of 1 (4 of them), two of 1/sqrt(2) (12) or
// four of 1/2 (8). The closest has the largest dot product, which needs only the largest one, two
// or all absolute components; the signs follow.
AMHEX_HD inline Quatf ClosestCubeRotation(const Quatf& relative) {
  const float component[4] = {relative.w, relative.x, relative.y, relative.z};
  int largest = 0;
  for (int i = 1; i < 4; ++i) {
    if (AbsoluteValue(component[i]) > AbsoluteValue(component[largest])) largest = i;
  }
  int second = largest == 0 ? 1 : 0;
  for (int i = 0; i < 4; ++i) {
    if (i != largest && AbsoluteValue(component[i]) > AbsoluteValue(component[second])) second = i;
  }
  const float one = AbsoluteValue(component[largest]);
  const float two = (one + AbsoluteValue(component[second])) * kHalfSquareRoot;
  const float four = (AbsoluteValue(component[0]) + AbsoluteValue(component[1]) +
                      AbsoluteValue(component[2]) + AbsoluteValue(component[3])) *
                     0.5f;
  float chosen[4] = {0, 0, 0, 0};
  if (one >= two && one >= four) {
    chosen[largest] = component[largest] > 0 ? 1.0f : -1.0f;
  } else if (two >= four) {
    chosen[largest] = component[largest] > 0 ? kHalfSquareRoot : -kHalfSquareRoot;
    chosen[second] = component[second] > 0 ? kHalfSquareRoot : -kHalfSquareRoot;
  } else {
    for (int i = 0; i < 4; ++i) chosen[i] = component[i] > 0 ? 0.5f : -0.5f;
  }
  return {chosen[0], chosen[1], chosen[2], chosen[3]};
}

// The representative of frame `q` (one of 24, two signs each) closest to `reference`.
AMHEX_HD inline Quatf MatchTo(const Quatf& reference, const Quatf& q) {
  const Quatf matched = q * Conjugate(ClosestCubeRotation(Conjugate(reference) * q));
  return Dot(matched, reference) < 0 ? -matched : matched;
}

// Frame `q` turned by the smallest rotation that brings one of its axes onto unit `normal`.
AMHEX_HD inline Quatf TurnNearestAxisTo(const Quatf& q, const Vec3f& normal) {
  Vec3f axis = AxisOf(q, 0);
  float alignment = Dot(axis, normal);
  for (int i = 1; i < 3; ++i) {
    const Vec3f other = AxisOf(q, i);
    const float dot = Dot(other, normal);
    if (AbsoluteValue(dot) > AbsoluteValue(alignment)) {
      axis = other;
      alignment = dot;
    }
  }
  if (alignment < 0) {
    axis = -axis;
    alignment = -alignment;
  }
  // The half-way quaternion; alignment is at least 1/sqrt(3), so it never vanishes.
  const Vec3f turn = Cross(axis, normal);
  return Normalized(Quatf{1.0f + alignment, turn.x, turn.y, turn.z}) * q;
}

}  // namespace amhex
