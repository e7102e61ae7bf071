// Loops that run eight numbers at a time, in one copy per vector width of the machine.
//
// Copies differ in nothing but the registers they use: every lane is computed by the same
// operations in the same order, nothing is fused, so all give the same bits.
#pragma once

#include <cstdint>
#include <type_traits>

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
using FloatLanes =
    float __attribute__((vector_size(kLanes * sizeof(float)), aligned(alignof(float))));
using FloatMask =
    int32_t __attribute__((vector_size(kLanes * sizeof(int32_t)), aligned(alignof(int32_t))));

// Marks functions that take or return lanes: how those are passed depends on the copy, so there
// must be no call.
#define AMHEX_LANES_INLINE __attribute__((always_inline)) inline

// Lanes anywhere among numbers. Clang heeds an alignment only where it stands with the name, as
// here, and takes the lanes above to begin where a register would.
using FloatsAmongNumbers __attribute__((aligned(alignof(float)))) = FloatLanes;
static_assert(alignof(FloatsAmongNumbers) == alignof(float));

// As one register, not copied byte by byte: the compilers let lanes alias their numbers.
AMHEX_LANES_INLINE FloatLanes LoadFloats(const float* from) {
  return *reinterpret_cast<const FloatsAmongNumbers*>(from);
}
AMHEX_LANES_INLINE void StoreFloats(const FloatLanes& lanes, float* to) {
  *reinterpret_cast<FloatsAmongNumbers*>(to) = lanes;
}

AMHEX_LANES_INLINE DoubleLanes LoadDoubles(const double* from) {
  using DoublesAmongNumbers __attribute__((aligned(alignof(double)))) = DoubleLanes;
  return *reinterpret_cast<const DoublesAmongNumbers*>(from);
}
AMHEX_LANES_INLINE void StoreDoubles(const DoubleLanes& lanes, double* to) {
  using DoublesAmongNumbers __attribute__((aligned(alignof(double)))) = DoubleLanes;
  *reinterpret_cast<DoublesAmongNumbers*>(to) = lanes;
}
// Eight indices of lanes.
AMHEX_LANES_INLINE LaneMask LoadIndices(const uint8_t* from) {
  using Bytes = uint8_t __attribute__((vector_size(kLanes), aligned(1)));
  return __builtin_convertvector(*reinterpret_cast<const Bytes*>(from), LaneMask);
}
// The lanes that the indices tell, of the first or, from kLanes on, the second.
AMHEX_LANES_INLINE DoubleLanes Picked(const DoubleLanes& first, const DoubleLanes& second,
                                      const LaneMask& indices) {
#if defined(__clang__)
  DoubleLanes picked;
  for (int lane = 0; lane < kLanes; ++lane) {
    const int64_t i = indices[lane];
    picked[lane] = i < kLanes ? first[i] : second[i - kLanes];
  }
  return picked;
#else
  return __builtin_shuffle(first, second, indices);
#endif
}
AMHEX_LANES_INLINE DoubleLanes Picked(const DoubleLanes& from, const LaneMask& indices) {
#if defined(__clang__)
  return Picked(from, from, indices);
#else
  return __builtin_shuffle(from, indices);
#endif
}

// Half of them. Where registers hold four numbers, lanes of eight doubles are compared and chosen
// one by one by this compiler, and taken through memory like that if a loop carries a sum of them;
// what does much of that goes through the halves.
inline constexpr int kHalfLanes = kLanes / 2;
using HalfLanes =
    double __attribute__((vector_size(kHalfLanes * sizeof(double)), aligned(alignof(double))));
using HalfMask =
    int64_t __attribute__((vector_size(kHalfLanes * sizeof(int64_t)), aligned(alignof(int64_t))));

template <int kCount>
struct LanesOf;
template <>
struct LanesOf<kLanes> {
  using Doubles = DoubleLanes;
  using Mask = LaneMask;
};
template <>
struct LanesOf<kHalfLanes> {
  using Doubles = HalfLanes;
  using Mask = HalfMask;
};

// Calls `body` with the number of lanes, a constant, that fit into one register, or half as many
// where none are as wide. As RunWithWidestVectors, everything that it calls is compiled into the
// copies.
template <class Body>
void RunInLanes(const Body& body) {
  constexpr std::integral_constant<int, kHalfLanes> kHalf;
  switch (WidestVectors()) {
    case VectorWidth::k512:
      return RunWithVectors512([&] { body(std::integral_constant<int, kLanes>()); });
    case VectorWidth::k256:
      return RunWithVectors256([&] { body(kHalf); });
    case VectorWidth::kBaseline:
      return body(kHalf);
  }
}

// Three coordinates of so many vectors.
template <int kCount>
struct VectorsOf {
  using Lanes = typename LanesOf<kCount>::Doubles;
  Lanes x, y, z;
  void Set(int lane, const Vec3d& v) { x[lane] = v.x, y[lane] = v.y, z[lane] = v.z; }
  Vec3d At(int lane) const { return {x[lane], y[lane], z[lane]}; }
  AMHEX_LANES_INLINE VectorsOf Towards(const Vec3d& p) const { return {p.x - x, p.y - y, p.z - z}; }
  AMHEX_LANES_INLINE VectorsOf From(const Vec3d& p) const { return {x - p.x, y - p.y, z - p.z}; }
  AMHEX_LANES_INLINE Lanes Dot(const VectorsOf& b) const { return x * b.x + y * b.y + z * b.z; }
  AMHEX_LANES_INLINE VectorsOf Cross(const VectorsOf& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
  // The names of Vec3's, for what is written for both.
  AMHEX_LANES_INLINE Lanes& operator[](int axis) { return axis == 0 ? x : (axis == 1 ? y : z); }
  AMHEX_LANES_INLINE const Lanes& operator[](int axis) const {
    return axis == 0 ? x : (axis == 1 ? y : z);
  }
  AMHEX_LANES_INLINE VectorsOf& operator+=(const VectorsOf& b) {
    x += b.x, y += b.y, z += b.z;
    return *this;
  }
  AMHEX_LANES_INLINE VectorsOf& operator-=(const VectorsOf& b) {
    x -= b.x, y -= b.y, z -= b.z;
    return *this;
  }
  AMHEX_LANES_INLINE VectorsOf& operator/=(double divisor) {
    x /= divisor, y /= divisor, z /= divisor;
    return *this;
  }
  friend AMHEX_LANES_INLINE VectorsOf operator+(const VectorsOf& a, const VectorsOf& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend AMHEX_LANES_INLINE VectorsOf operator-(const VectorsOf& a, const VectorsOf& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend AMHEX_LANES_INLINE VectorsOf operator*(const VectorsOf& a, const Lanes& s) {
    return {a.x * s, a.y * s, a.z * s};
  }
  friend AMHEX_LANES_INLINE VectorsOf operator*(const VectorsOf& a, double s) {
    return {a.x * s, a.y * s, a.z * s};
  }
};
using VectorLanes = VectorsOf<kLanes>;

template <int kCount>
AMHEX_LANES_INLINE auto Dot(const VectorsOf<kCount>& a, const VectorsOf<kCount>& b) {
  return a.Dot(b);
}
template <int kCount>
AMHEX_LANES_INLINE VectorsOf<kCount> Cross(const VectorsOf<kCount>& a, const VectorsOf<kCount>& b) {
  return a.Cross(b);
}
template <int kCount>
AMHEX_LANES_INLINE auto Determinant(const VectorsOf<kCount>& a, const VectorsOf<kCount>& b,
                                    const VectorsOf<kCount>& c) {
  return a.Dot(b.Cross(c));
}

// Square roots, correctly rounded.
AMHEX_LANES_INLINE DoubleLanes SquareRoot(const DoubleLanes& squares) {
  DoubleLanes roots;
  for (int lane = 0; lane < kLanes; ++lane) roots[lane] = __builtin_sqrt(squares[lane]);
  return roots;
}
AMHEX_LANES_INLINE HalfLanes SquareRoot(const HalfLanes& squares) {
  HalfLanes roots;
  for (int lane = 0; lane < kHalfLanes; ++lane) roots[lane] = __builtin_sqrt(squares[lane]);
  return roots;
}
// Without what is behind the point.
AMHEX_LANES_INLINE HalfLanes Truncated(const HalfLanes& numbers) {
  HalfLanes whole;
  for (int lane = 0; lane < kHalfLanes; ++lane) whole[lane] = __builtin_trunc(numbers[lane]);
  return whole;
}
// Bit by bit, which lanes are true.
AMHEX_LANES_INLINE uint32_t BitsOf(const LaneMask& mask) {
  LaneMask bits = mask & LaneMask{1, 2, 4, 8, 16, 32, 64, 128};
  bits |= __builtin_shufflevector(bits, bits, 4, 5, 6, 7, 0, 1, 2, 3);
  bits |= __builtin_shufflevector(bits, bits, 2, 3, 0, 1, 6, 7, 4, 5);
  return static_cast<uint32_t>(bits[0] | bits[1]);
}
AMHEX_LANES_INLINE uint32_t BitsOf(const HalfMask& mask) {
  HalfMask bits = mask & HalfMask{1, 2, 4, 8};
  bits |= __builtin_shufflevector(bits, bits, 2, 3, 0, 1);
  return static_cast<uint32_t>(bits[0] | bits[1]);
}
AMHEX_LANES_INLINE uint32_t BitsOf(const FloatMask& mask) {
  FloatMask bits = mask & FloatMask{1, 2, 4, 8, 16, 32, 64, 128};
  bits |= __builtin_shufflevector(bits, bits, 4, 5, 6, 7, 0, 1, 2, 3);
  bits |= __builtin_shufflevector(bits, bits, 2, 3, 0, 1, 6, 7, 4, 5);
  return static_cast<uint32_t>(bits[0] | bits[1]);
}
AMHEX_LANES_INLINE bool AnyLane(const LaneMask& mask) {
  int64_t any = 0;
  for (int lane = 0; lane < kLanes; ++lane) any |= mask[lane];
  return any != 0;
}
AMHEX_LANES_INLINE bool AnyLane(const HalfMask& mask) {
  return ((mask[0] | mask[1]) | (mask[2] | mask[3])) != 0;
}

// What does not fit into the last lanes is padded by the caller.
inline constexpr int64_t LaneBlocks(int64_t count) { return (count + kLanes - 1) / kLanes; }

}  // namespace amhex
