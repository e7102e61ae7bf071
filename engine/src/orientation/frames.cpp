#include "orientation/frames.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/platform.h"
#include "orientation/octahedral_match.h"

namespace amhex {
namespace {

// A tangent closer to the normal than this (sine of the angle) says nothing.
constexpr double kLeastTangentSine = 1e-3;

}  // namespace

Quatf QuatFromFrame(const AxisFrame& frame) {
  Eigen::Matrix3d matrix;
  for (int axis = 0; axis < 3; ++axis) {
    for (int row = 0; row < 3; ++row) {
      matrix(row, axis) = frame.axis[static_cast<size_t>(axis)][row];
    }
  }
  Eigen::Quaterniond q(matrix);
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
          static_cast<float>(q.z())};
}

AxisFrame FrameFromQuat(const Quatf& q) {
  const Eigen::Matrix3d matrix =
      Eigen::Quaterniond(static_cast<double>(q.w), static_cast<double>(q.x),
                         static_cast<double>(q.y), static_cast<double>(q.z))
          .normalized()
          .toRotationMatrix();
  AxisFrame frame;
  for (int axis = 0; axis < 3; ++axis) {
    frame.axis[static_cast<size_t>(axis)] = {matrix(0, axis), matrix(1, axis), matrix(2, axis)};
  }
  return frame;
}

Quatf SampleOrientation(const Vec3d& normal, const Vec3d& tangent) {
  const Vec3d flat = tangent - normal * Dot(normal, tangent);
  if (!(Norm(flat) > kLeastTangentSine * Norm(tangent))) {
    return TurnNearestAxisTo(Quatf{}, ToFloat(normal));
  }
  const Vec3d unit = Normalized(flat);
  return QuatFromFrame(AxisFrame{{normal, unit, Cross(normal, unit)}});
}

}  // namespace amhex
