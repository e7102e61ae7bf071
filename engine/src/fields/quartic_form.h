// Means of frames that do not depend on how their axes are named.
//
// A frame with the axes a_0, a_1, a_2 stands for the quartic form P(x) = sum (a_k . x)^4: equal for
// all 24 namings, so forms of neighbours may simply be added. The frame nearest to a sum of forms
// maximises P(a_0) + P(a_1) + P(a_2). Compared with a running mean of matched quaternions nothing
// depends on the order of the neighbours, and frames that disagree by 45 degrees do not pull at
// all; the fields come out with fewer and better placed singularities.
#pragma once

#include <array>
#include <cmath>

#include "amhex/vec3.h"
#include "fields/frame_math.h"

namespace amhex::fields {

// Of the form with the coefficients `c` at v; one number each, or one per lane. Always inlined: how
// lanes are returned by a call depends on the machine (base/vector_lanes.h).
template <class Vector, class Number>
__attribute__((always_inline)) AMHEX_HD inline Vector QuarticGradient(const Number* c,
                                                                      const Vector& v) {
  const Number &x = v.x, &y = v.y, &z = v.z;
  const Number xx = x * x, yy = y * y, zz = z * z;
  return {xx * (4 * c[0] * x + 3 * (c[3] * y + c[4] * z)) + c[5] * yy * y + c[7] * zz * z +
              2 * x * (c[9] * yy + c[10] * zz + c[12] * y * z) + y * z * (c[13] * y + c[14] * z),
          yy * (4 * c[1] * y + 3 * (c[5] * x + c[6] * z)) + c[3] * xx * x + c[8] * zz * z +
              2 * y * (c[9] * xx + c[11] * zz + c[13] * x * z) + x * z * (c[12] * x + c[14] * z),
          zz * (4 * c[2] * z + 3 * (c[7] * x + c[8] * y)) + c[4] * xx * x + c[6] * yy * y +
              2 * z * (c[10] * xx + c[11] * yy + c[14] * x * y) + x * y * (c[12] * x + c[13] * y)};
}

inline constexpr int kQuarticTerms = 15;

// Coefficients, binomial factors included, of x^4 y^4 z^4, x^3y x^3z y^3x y^3z z^3x z^3y,
// x^2y^2 x^2z^2 y^2z^2, x^2yz xy^2z xyz^2; a sixteenth that is always zero fills the vector.
struct QuarticForm {
  std::array<float, kQuarticTerms + 1> coefficients{};

  AMHEX_HD void Add(const QuarticForm& other, float weight) {
    for (int k = 0; k <= kQuarticTerms; ++k) coefficients[k] += weight * other.coefficients[k];
  }
  // Of P at x.
  AMHEX_HD Vec3d Gradient(const Vec3d& x) const {
    double c[kQuarticTerms];
    for (int k = 0; k < kQuarticTerms; ++k) c[k] = coefficients[k];
    return QuarticGradient(c, x);
  }
};

// Newton's iteration for the polar rotation squares the error each time: from 45 degrees off to
// rounding.
inline constexpr int kPolarIterations = 8;
inline constexpr double kConvergedChange = 1e-14;  // squared; the next change would be its square
inline constexpr double kMinDeterminant = 1e-3;

// (axis . x)^4.
AMHEX_HD inline QuarticForm FormOfAxis(const Vec3d& axis) {
  const auto x = static_cast<float>(axis.x), y = static_cast<float>(axis.y),
             z = static_cast<float>(axis.z);
  const float xx = x * x, yy = y * y, zz = z * z;
  const float xy = x * y, xz = x * z, yz = y * z;
  return {{xx * xx, yy * yy, zz * zz, 4 * xx * xy, 4 * xx * xz, 4 * yy * xy, 4 * yy * yz,
           4 * zz * xz, 4 * zz * yz, 6 * xx * yy, 6 * xx * zz, 6 * yy * zz, 12 * xx * yz,
           12 * yy * xz, 12 * zz * xy, 0}};
}

AMHEX_HD inline QuarticForm FormOfFrame(const Quaternion& frame) {
  const AxisFrame axes = ToFrame(frame);
  QuarticForm form = FormOfAxis(axes.axis[0]);
  form.Add(FormOfAxis(axes.axis[1]), 1.0F);
  form.Add(FormOfAxis(axes.axis[2]), 1.0F);
  return form;
}

// Rotation nearest to the matrix with these columns (Newton's iteration); false if their
// determinant is not clearly positive for columns of about unit length.
AMHEX_HD inline bool NearestRotationMatrix(AxisFrame* columns) {
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

// `start` moved towards the frame nearest to `form` by so many rounds of the ascent that replaces
// the axes by the rotation nearest to their gradients. Every round raises P(a_0) + P(a_1) + P(a_2)
// (P is convex); the error falls with its third power where the summed frames agree. Returns
// `start` for a form without preference.
AMHEX_HD inline Quaternion NearestFrame(const QuarticForm& form, const Quaternion& start,
                                        int rounds) {
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
