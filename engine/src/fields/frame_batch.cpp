#include "fields/frame_batch.h"

namespace amhex::fields {
namespace {

// What follows is NearestFrame for eight forms at a time, each step in the same order.
struct QuaternionLanes {
  DoubleLanes w, x, y, z;
};
using ColumnLanes = std::array<VectorLanes, 3>;
struct FormLanes {
  DoubleLanes coefficients[kQuarticTerms];
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
      axis = QuarticGradient(forms.coefficients, axis);
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
    for (int k = 0; k < kQuarticTerms; ++k) {
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

}  // namespace amhex::fields
