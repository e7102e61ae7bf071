// Loops that run eight numbers at a time, in one copy per vector width of the machine.
//
// Copies differ in nothing but the registers they use: every lane is computed by the same
// operations in the same order, nothing is fused, so all give the same bits.
#pragma once

#include <cstdint>

#include "base/platform.h"
#include "base/widest_vectors.h"

namespace amhex {

inline constexpr int kLanes = 8;

// Operators act lane by lane; a comparison gives LaneMask, and `mask ? a : b` chooses by lane.
// Aligned like a single number: what wider registers ask for differs between the copies.
using DoubleLanes =
    double __attribute__((vector_size(kLanes * sizeof(double)), aligned(alignof(double))));
using LaneMask =
    int64_t __attribute__((vector_size(kLanes * sizeof(int64_t)), aligned(alignof(int64_t))));

// Marks functions that take or return lanes: how those are passed depends on the copy, so there
// must be no call.
#define AMHEX_LANES_INLINE __attribute__((always_inline)) inline

// Three coordinates of eight vectors.
struct VectorLanes {
  DoubleLanes x, y, z;
  void Set(int lane, const Vec3d& v) { x[lane] = v.x, y[lane] = v.y, z[lane] = v.z; }
  Vec3d At(int lane) const { return {x[lane], y[lane], z[lane]}; }
  AMHEX_LANES_INLINE VectorLanes Towards(const Vec3d& p) const {
    return {p.x - x, p.y - y, p.z - z};
  }
  AMHEX_LANES_INLINE VectorLanes From(const Vec3d& p) const { return {x - p.x, y - p.y, z - p.z}; }
  AMHEX_LANES_INLINE DoubleLanes Dot(const VectorLanes& b) const {
    return x * b.x + y * b.y + z * b.z;
  }
  AMHEX_LANES_INLINE VectorLanes Cross(const VectorLanes& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
  // The names of Vec3's, for what is written for both.
  AMHEX_LANES_INLINE DoubleLanes& operator[](int axis) {
    return axis == 0 ? x : (axis == 1 ? y : z);
  }
  AMHEX_LANES_INLINE const DoubleLanes& operator[](int axis) const {
    return axis == 0 ? x : (axis == 1 ? y : z);
  }
  AMHEX_LANES_INLINE VectorLanes& operator+=(const VectorLanes& b) {
    x += b.x, y += b.y, z += b.z;
    return *this;
  }
  AMHEX_LANES_INLINE VectorLanes& operator-=(const VectorLanes& b) {
    x -= b.x, y -= b.y, z -= b.z;
    return *this;
  }
  AMHEX_LANES_INLINE VectorLanes& operator/=(double divisor) {
    x /= divisor, y /= divisor, z /= divisor;
    return *this;
  }
  friend AMHEX_LANES_INLINE VectorLanes operator+(const VectorLanes& a, const VectorLanes& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend AMHEX_LANES_INLINE VectorLanes operator-(const VectorLanes& a, const VectorLanes& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend AMHEX_LANES_INLINE VectorLanes operator*(const VectorLanes& a, const DoubleLanes& s) {
    return {a.x * s, a.y * s, a.z * s};
  }
  friend AMHEX_LANES_INLINE VectorLanes operator*(const VectorLanes& a, double s) {
    return {a.x * s, a.y * s, a.z * s};
  }
};
AMHEX_LANES_INLINE DoubleLanes Dot(const VectorLanes& a, const VectorLanes& b) { return a.Dot(b); }
AMHEX_LANES_INLINE VectorLanes Cross(const VectorLanes& a, const VectorLanes& b) {
  return a.Cross(b);
}
AMHEX_LANES_INLINE DoubleLanes Determinant(const VectorLanes& a, const VectorLanes& b,
                                           const VectorLanes& c) {
  return a.Dot(b.Cross(c));
}

// Square roots, correctly rounded.
AMHEX_LANES_INLINE DoubleLanes SquareRoot(const DoubleLanes& squares) {
  DoubleLanes roots;
  for (int lane = 0; lane < kLanes; ++lane) roots[lane] = __builtin_sqrt(squares[lane]);
  return roots;
}
AMHEX_LANES_INLINE bool AnyLane(const LaneMask& mask) {
  int64_t any = 0;
  for (int lane = 0; lane < kLanes; ++lane) any |= mask[lane];
  return any != 0;
}

// What does not fit into the last lanes is padded by the caller.
inline constexpr int64_t LaneBlocks(int64_t count) { return (count + kLanes - 1) / kLanes; }

}  // namespace amhex
