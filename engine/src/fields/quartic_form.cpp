#include "fields/quartic_form.h"

#include <cmath>

namespace amhex::fields {
namespace {

// Newton's iteration for the polar rotation squares the error each time: from 45 degrees off to
// rounding.
constexpr int kPolarIterations = 8;
constexpr double kConvergedChange = 1e-14;  // squared; the next change would be its square
constexpr double kMinDeterminant = 1e-3;

}  // namespace

Vec3d QuarticForm::Gradient(const Vec3d& v) const {
  const std::array<float, 15>& c = coefficients;
  const double x = v.x, y = v.y, z = v.z;
  const double xx = x * x, yy = y * y, zz = z * z;
  return {xx * (4 * c[0] * x + 3 * (c[3] * y + c[4] * z)) + c[5] * yy * y + c[7] * zz * z +
              2 * x * (c[9] * yy + c[10] * zz + c[12] * y * z) + y * z * (c[13] * y + c[14] * z),
          yy * (4 * c[1] * y + 3 * (c[5] * x + c[6] * z)) + c[3] * xx * x + c[8] * zz * z +
              2 * y * (c[9] * xx + c[11] * zz + c[13] * x * z) + x * z * (c[12] * x + c[14] * z),
          zz * (4 * c[2] * z + 3 * (c[7] * x + c[8] * y)) + c[4] * xx * x + c[6] * yy * y +
              2 * z * (c[10] * xx + c[11] * yy + c[14] * x * y) + x * y * (c[12] * x + c[13] * y)};
}

QuarticForm FormOfAxis(const Vec3d& axis) {
  const auto x = static_cast<float>(axis.x), y = static_cast<float>(axis.y),
             z = static_cast<float>(axis.z);
  const float xx = x * x, yy = y * y, zz = z * z;
  const float xy = x * y, xz = x * z, yz = y * z;
  return {{xx * xx, yy * yy, zz * zz, 4 * xx * xy, 4 * xx * xz, 4 * yy * xy, 4 * yy * yz,
           4 * zz * xz, 4 * zz * yz, 6 * xx * yy, 6 * xx * zz, 6 * yy * zz, 12 * xx * yz,
           12 * yy * xz, 12 * zz * xy}};
}

QuarticForm FormOfFrame(const Quaternion& frame) {
  const AxisFrame axes = ToFrame(frame);
  QuarticForm form = FormOfAxis(axes.axis[0]);
  form.Add(FormOfAxis(axes.axis[1]), 1.0F);
  form.Add(FormOfAxis(axes.axis[2]), 1.0F);
  return form;
}

bool NearestRotationMatrix(AxisFrame* columns) {
  std::array<Vec3d, 3>& a = columns->axis;
  for (int k = 0; k < kPolarIterations; ++k) {
    const double determinant = Determinant(a[0], a[1], a[2]);
    if (!(determinant > kMinDeterminant)) return false;
    // The transposed inverse has the cofactors as columns.
    const std::array<Vec3d, 3> cofactor{Cross(a[1], a[2]), Cross(a[2], a[0]), Cross(a[0], a[1])};
    double change = 0;
    for (int c = 0; c < 3; ++c) {
      const Vec3d next = (a[c] + cofactor[c] / determinant) * 0.5;
      change += SquaredNorm(next - a[c]);
      a[c] = next;
    }
    if (change < kConvergedChange) break;
  }
  return true;
}

Quaternion NearestFrame(const QuarticForm& form, const Quaternion& start, int rounds) {
  Quaternion frame = start;
  for (int round = 0; round < rounds; ++round) {
    AxisFrame gradients = ToFrame(frame);
    double squared = 0;
    for (Vec3d& axis : gradients.axis) {
      axis = form.Gradient(axis);
      squared += SquaredNorm(axis);
    }
    if (!(squared > 0)) return frame;
    for (Vec3d& axis : gradients.axis) axis *= std::sqrt(3 / squared);
    if (!NearestRotationMatrix(&gradients)) return frame;
    frame = FromFrame(gradients);
  }
  return frame;
}

}  // namespace amhex::fields
