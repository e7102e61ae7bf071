#include "fields/frame_batch.h"

#include <cstring>

namespace amhex::fields {
namespace {

// What follows is NearestFrame for kCount forms at a time, each step in the same order.
template <int kCount>
using NumbersIn = typename LanesOf<kCount>::Doubles;
template <int kCount>
using MaskIn = typename LanesOf<kCount>::Mask;

template <int kCount>
struct QuaternionsIn {
  NumbersIn<kCount> w, x, y, z;
};
template <int kCount>
using ColumnsIn = std::array<VectorsOf<kCount>, 3>;
template <int kCount>
struct FormsIn {
  NumbersIn<kCount> coefficients[kQuarticTerms];
};

template <int kCount>
AMHEX_LANES_INLINE VectorsOf<kCount> Blend(const MaskIn<kCount>& mask, const VectorsOf<kCount>& a,
                                           const VectorsOf<kCount>& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}
template <int kCount>
AMHEX_LANES_INLINE QuaternionsIn<kCount> Blend(const MaskIn<kCount>& mask,
                                               const QuaternionsIn<kCount>& a,
                                               const QuaternionsIn<kCount>& b) {
  return {mask ? a.w : b.w, mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}
template <int kCount>
AMHEX_LANES_INLINE VectorsOf<kCount> Scaled(const VectorsOf<kCount>& v,
                                            const NumbersIn<kCount>& s) {
  return {v.x * s, v.y * s, v.z * s};
}

template <int kCount>
AMHEX_LANES_INLINE ColumnsIn<kCount> FramesOf(const QuaternionsIn<kCount>& q) {
  return {VectorsOf<kCount>{1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z),
                            2 * (q.x * q.z - q.w * q.y)},
          VectorsOf<kCount>{2 * (q.x * q.y - q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z),
                            2 * (q.y * q.z + q.w * q.x)},
          VectorsOf<kCount>{2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x),
                            1 - 2 * (q.x * q.x + q.y * q.y)}};
}

template <int kCount>
AMHEX_LANES_INLINE QuaternionsIn<kCount> QuaternionsOf(const ColumnsIn<kCount>& frame) {
  const VectorsOf<kCount>&a = frame[0], &b = frame[1], &c = frame[2];
  const NumbersIn<kCount> w = 1 + a.x + b.y + c.z, x = 1 + a.x - b.y - c.z;
  const NumbersIn<kCount> y = 1 - a.x + b.y - c.z, z = 1 - a.x - b.y + c.z;
  NumbersIn<kCount> largest = w;
  QuaternionsIn<kCount> q = {w, b.z - c.y, c.x - a.z, a.y - b.x};
  const MaskIn<kCount> by_x = x > largest;
  q = Blend(by_x, {b.z - c.y, x, a.y + b.x, c.x + a.z}, q);
  largest = by_x ? x : largest;
  const MaskIn<kCount> by_y = y > largest;
  q = Blend(by_y, {c.x - a.z, a.y + b.x, y, b.z + c.y}, q);
  largest = by_y ? y : largest;
  q = Blend(z > largest, {a.y - b.x, c.x + a.z, b.z + c.y, z}, q);
  const NumbersIn<kCount> scale = 1 / SquareRoot(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w * scale, q.x * scale, q.y * scale, q.z * scale};
}

// Lanes of `wanted` become rotations; returns those that have.
template <int kCount>
AMHEX_LANES_INLINE MaskIn<kCount> MakeRotations(const MaskIn<kCount>& wanted,
                                                ColumnsIn<kCount>& a) {
  MaskIn<kCount> good = wanted, moving = wanted;
  for (int k = 0; k < kPolarIterations && AnyLane(moving); ++k) {
    const NumbersIn<kCount> determinant = a[0].Dot(a[1].Cross(a[2]));
    const MaskIn<kCount> is_proper = determinant > kMinDeterminant;
    good &= is_proper | ~moving;
    moving &= is_proper;
    const ColumnsIn<kCount> cofactor = {a[1].Cross(a[2]), a[2].Cross(a[0]), a[0].Cross(a[1])};
    NumbersIn<kCount> change{};
    for (int c = 0; c < 3; ++c) {
      const VectorsOf<kCount> next = {(a[c].x + cofactor[c].x / determinant) * 0.5,
                                      (a[c].y + cofactor[c].y / determinant) * 0.5,
                                      (a[c].z + cofactor[c].z / determinant) * 0.5};
      const VectorsOf<kCount> moved = {next.x - a[c].x, next.y - a[c].y, next.z - a[c].z};
      change += moved.Dot(moved);
      a[c] = Blend(moving, next, a[c]);
    }
    moving &= ~(change < kConvergedChange);
  }
  return good;
}

template <int kCount>
AMHEX_LANES_INLINE void Ascend(const FormsIn<kCount>& forms, int rounds,
                               QuaternionsIn<kCount>& frames) {
  MaskIn<kCount> ascending = MaskIn<kCount>{} - 1;
  for (int round = 0; round < rounds; ++round) {
    ColumnsIn<kCount> gradients = FramesOf(frames);
    NumbersIn<kCount> squared{};
    for (VectorsOf<kCount>& axis : gradients) {
      axis = QuarticGradient(forms.coefficients, axis);
      squared += axis.Dot(axis);
    }
    ascending &= squared > 0;
    const NumbersIn<kCount> scale = SquareRoot(3 / squared);
    for (VectorsOf<kCount>& axis : gradients) axis = Scaled(axis, scale);
    ascending = MakeRotations(ascending, gradients);
    frames = Blend(ascending, QuaternionsOf(gradients), frames);
  }
}

// Those from `first` on.
template <int kCount>
AMHEX_LANES_INLINE void FindSome(int rounds, int first, FrameBatch* batch) {
  FormsIn<kCount> forms;
  for (int k = 0; k < kQuarticTerms; ++k) {
    for (int lane = 0; lane < kCount; ++lane) {
      forms.coefficients[k][lane] = batch->forms[first + lane].coefficients[k];
    }
  }
  double numbers[4][kCount];
  for (int lane = 0; lane < kCount; ++lane) {
    const Quaternion& q = batch->frames[first + lane];
    numbers[0][lane] = q.w, numbers[1][lane] = q.x, numbers[2][lane] = q.y, numbers[3][lane] = q.z;
  }
  QuaternionsIn<kCount> frames;
  std::memcpy(&frames, numbers, sizeof(frames));
  Ascend<kCount>(forms, rounds, frames);
  for (int lane = 0; lane < kCount; ++lane) {
    batch->frames[first + lane] = {frames.w[lane], frames.x[lane], frames.y[lane], frames.z[lane]};
  }
}

}  // namespace

void FindNearestFrames(int rounds, FrameBatch* batch) {
  RunInLanes([&](auto lanes) {
    for (int first = 0; first < kLanes; first += lanes()) FindSome<lanes()>(rounds, first, batch);
  });
}

}  // namespace amhex::fields
