// Frames that stand exactly between several ways to follow the hull; usable where bodies run.
#pragma once

#include <cmath>

#include "fields/frame_math.h"
#include "fields/match_code.h"
#include "fields/quartic_form.h"

namespace amhex::fields {

// A frame is balanced where no direction of its ascent is steeper than this part of what it could
// be: 0.1 degrees beside a normal that is equally far from two axes.
inline constexpr double kBalancedTorque = 1e-3;
// And between several ways, if a small turn brings more than this part of what the form gives it.
inline constexpr double kBalancedGain = 1e-3;
// By 0.1 radians about one of its axes: small enough to be undone where the neighbours hold a
// frame, large enough to grow within a few sweeps elsewhere. Cosine and sine of the half.
inline constexpr double kSmallTurnCosine = 0.99875026, kSmallTurnSine = 0.04997917;

// P(a_0) + P(a_1) + P(a_2), and the torque with which the form turns the axes.
struct FrameGain {
  double sum = 0;
  Vec3d torque;
  double strength = 0;  // largest torque that gradients of that length could have
};

AMHEX_HD inline FrameGain GainOf(const QuarticForm& form, const Quaternion& frame) {
  FrameGain gain;
  for (const Vec3d& axis : ToFrame(frame).axis) {
    const Vec3d gradient = form.Gradient(axis);
    gain.sum += Dot(axis, gradient) * 0.25;  // P is homogeneous of degree four
    gain.torque += Cross(axis, gradient);
    gain.strength += Norm(gradient);
  }
  return gain;
}

AMHEX_HD inline Quaternion SmallTurnAbout(int axis) {
  return {kSmallTurnCosine, axis == 0 ? kSmallTurnSine : 0, axis == 1 ? kSmallTurnSine : 0,
          axis == 2 ? kSmallTurnSine : 0};
}

// `frame`, or where `form` (what the hull wishes) is in balance about it although other frames suit
// it better, `frame` turned a little about the axis that gains most. Without that the ascent never
// leaves the start where normals are along the diagonals of its axes, as those of a tetrahedron
// between four corners of a cube: no face is followed anywhere, and what the neighbours wish is
// symmetrical, too.
AMHEX_HD inline Quaternion OutOfBalance(const QuarticForm& form, const Quaternion& frame) {
  const FrameGain here = GainOf(form, frame);
  if (Norm(here.torque) > kBalancedTorque * here.strength) return frame;
  double most = here.sum * (1 + kBalancedGain);
  Quaternion best = frame;
  for (int axis = 0; axis < 3; ++axis) {
    const Quaternion turned = Normalized(Multiply(frame, SmallTurnAbout(axis)));
    const double sum = GainOf(form, turned).sum;
    if (!(sum > most)) continue;
    most = sum;
    best = turned;
  }
  return best;
}

}  // namespace amhex::fields
