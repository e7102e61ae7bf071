#include "fields/quartic_form.h"

#include <cmath>

namespace amhex::fields {
namespace {

// Newton's iteration for the polar rotation squares the error each time: from 45 degrees off to
// rounding.
constexpr int kPolarIterations = 8;
constexpr double kConvergedChange = 1e-14;  // squared; the next change would be its square
constexpr double kMinDeterminant = 1e-3;

// What follows is NearestFrame for eight forms at a time, each step in the same order.
struct QuaternionLanes {
  DoubleLanes w, x, y, z;
};
using ColumnLanes = std::array<VectorLanes, 3>;
struct FormLanes {
  DoubleLanes coefficients[15];
};

AMHEX_LANES_INLINE VectorLanes Blend(const LaneMask& mask, const VectorLanes& a,
                                     const VectorLanes& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}
AMHEX_LANES_INLINE QuaternionLanes Blend(const LaneMask& mask, const QuaternionLanes& a,
                                         const QuaternionLanes& b) {
  return {mask ? a.w : b.w, mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}
AMHEX_LANES_INLINE VectorLanes Scaled(const VectorLanes& v, const DoubleLanes& s) {
  return {v.x * s, v.y * s, v.z * s};
}

AMHEX_LANES_INLINE ColumnLanes FramesOf(const QuaternionLanes& q) {
  return {VectorLanes{1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z),
                      2 * (q.x * q.z - q.w * q.y)},
          VectorLanes{2 * (q.x * q.y - q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z),
                      2 * (q.y * q.z + q.w * q.x)},
          VectorLanes{2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x),
                      1 - 2 * (q.x * q.x + q.y * q.y)}};
}

AMHEX_LANES_INLINE QuaternionLanes QuaternionsOf(const ColumnLanes& frame) {
  const VectorLanes &a = frame[0], &b = frame[1], &c = frame[2];
  const DoubleLanes w = 1 + a.x + b.y + c.z, x = 1 + a.x - b.y - c.z;
  const DoubleLanes y = 1 - a.x + b.y - c.z, z = 1 - a.x - b.y + c.z;
  DoubleLanes largest = w;
  QuaternionLanes q = {w, b.z - c.y, c.x - a.z, a.y - b.x};
  const LaneMask by_x = x > largest;
  q = Blend(by_x, {b.z - c.y, x, a.y + b.x, c.x + a.z}, q);
  largest = by_x ? x : largest;
  const LaneMask by_y = y > largest;
  q = Blend(by_y, {c.x - a.z, a.y + b.x, y, b.z + c.y}, q);
  largest = by_y ? y : largest;
  q = Blend(z > largest, {a.y - b.x, c.x + a.z, b.z + c.y, z}, q);
  const DoubleLanes scale = 1 / SquareRoot(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w * scale, q.x * scale, q.y * scale, q.z * scale};
}

AMHEX_LANES_INLINE VectorLanes GradientOf(const FormLanes& form, const VectorLanes& v) {
  const auto& c = form.coefficients;
  const DoubleLanes &x = v.x, &y = v.y, &z = v.z;
  const DoubleLanes xx = x * x, yy = y * y, zz = z * z;
  return {xx * (4 * c[0] * x + 3 * (c[3] * y + c[4] * z)) + c[5] * yy * y + c[7] * zz * z +
              2 * x * (c[9] * yy + c[10] * zz + c[12] * y * z) + y * z * (c[13] * y + c[14] * z),
          yy * (4 * c[1] * y + 3 * (c[5] * x + c[6] * z)) + c[3] * xx * x + c[8] * zz * z +
              2 * y * (c[9] * xx + c[11] * zz + c[13] * x * z) + x * z * (c[12] * x + c[14] * z),
          zz * (4 * c[2] * z + 3 * (c[7] * x + c[8] * y)) + c[4] * xx * x + c[6] * yy * y +
              2 * z * (c[10] * xx + c[11] * yy + c[14] * x * y) + x * y * (c[12] * x + c[13] * y)};
}

// Lanes of `wanted` become rotations; returns those that have.
AMHEX_LANES_INLINE LaneMask MakeRotations(const LaneMask& wanted, ColumnLanes& a) {
  LaneMask good = wanted, moving = wanted;
  for (int k = 0; k < kPolarIterations && AnyLane(moving); ++k) {
    const DoubleLanes determinant = a[0].Dot(a[1].Cross(a[2]));
    const LaneMask is_proper = determinant > kMinDeterminant;
    good &= is_proper | ~moving;
    moving &= is_proper;
    const ColumnLanes cofactor = {a[1].Cross(a[2]), a[2].Cross(a[0]), a[0].Cross(a[1])};
    DoubleLanes change{};
    for (int c = 0; c < 3; ++c) {
      const VectorLanes next = {(a[c].x + cofactor[c].x / determinant) * 0.5,
                                (a[c].y + cofactor[c].y / determinant) * 0.5,
                                (a[c].z + cofactor[c].z / determinant) * 0.5};
      const VectorLanes moved = {next.x - a[c].x, next.y - a[c].y, next.z - a[c].z};
      change += moved.Dot(moved);
      a[c] = Blend(moving, next, a[c]);
    }
    moving &= ~(change < kConvergedChange);
  }
  return good;
}

AMHEX_LANES_INLINE void Ascend(const FormLanes& forms, int rounds, QuaternionLanes& frames) {
  LaneMask ascending = LaneMask{} - 1;
  for (int round = 0; round < rounds; ++round) {
    ColumnLanes gradients = FramesOf(frames);
    DoubleLanes squared{};
    for (VectorLanes& axis : gradients) {
      axis = GradientOf(forms, axis);
      squared += axis.Dot(axis);
    }
    ascending &= squared > 0;
    const DoubleLanes scale = SquareRoot(3 / squared);
    for (VectorLanes& axis : gradients) axis = Scaled(axis, scale);
    ascending = MakeRotations(ascending, gradients);
    frames = Blend(ascending, QuaternionsOf(gradients), frames);
  }
}

}  // namespace

void FindNearestFrames(int rounds, FrameBatch* batch) {
  RunWithWidestVectors([&] {
    FormLanes forms;
    for (int k = 0; k < 15; ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        forms.coefficients[k][lane] = batch->forms[lane].coefficients[k];
      }
    }
    QuaternionLanes frames;
    for (int lane = 0; lane < kLanes; ++lane) {
      const Quaternion& q = batch->frames[lane];
      frames.w[lane] = q.w, frames.x[lane] = q.x, frames.y[lane] = q.y, frames.z[lane] = q.z;
    }
    Ascend(forms, rounds, frames);
    for (int lane = 0; lane < kLanes; ++lane) {
      batch->frames[lane] = {frames.w[lane], frames.x[lane], frames.y[lane], frames.z[lane]};
    }
  });
}

Vec3d QuarticForm::Gradient(const Vec3d& v) const {
  const std::array<float, 16>& c = coefficients;
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
           12 * yy * xz, 12 * zz * xy, 0}};
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
