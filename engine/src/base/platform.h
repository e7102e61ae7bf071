// What per-element bodies need from the machine they are compiled for: host by g++, device by nvcc.
//
// Every operation here gives the same bits on both machines: fused multiply-adds are explicit,
// and atomics are used on integers only, where the order of additions cannot matter.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>

#include "amhex/vec3.h"

// One copy of a host function per vector width, each marked with one of these. Everything that
// such a function calls is inlined into it. Elsewhere the marks mean nothing.
#if !defined(__CUDACC__) && defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define AMHEX_VECTORS_512 __attribute__((flatten, target("arch=x86-64-v4")))
#define AMHEX_VECTORS_256 __attribute__((flatten, target("arch=x86-64-v3")))
#define AMHEX_HAS_VECTOR_WIDTHS 1
#else
#define AMHEX_VECTORS_512
#define AMHEX_VECTORS_256
#define AMHEX_HAS_VECTOR_WIDTHS 0
#endif

// For functions that numbers and lanes of numbers share (vector_lanes.h): of lanes there must be no
// call. On a device there are none.
#if defined(__CUDACC__)
#define AMHEX_LANES_TOO AMHEX_HD inline
#else
#define AMHEX_LANES_TOO __attribute__((always_inline)) inline
#endif

namespace amhex {

// Which copy to run; results are the same to the bit.
enum class VectorWidth : uint8_t { kBaseline, k256, k512 };

// No wider copy runs. Tests lower it to compare the copies of whole runs.
inline std::atomic<VectorWidth> vector_width_limit{VectorWidth::k512};

// The widest that this machine has, up to the limit.
AMHEX_HD inline VectorWidth WidestVectors() {
#if AMHEX_HAS_VECTOR_WIDTHS
  static const VectorWidth widest = __builtin_cpu_supports("x86-64-v4")   ? VectorWidth::k512
                                    : __builtin_cpu_supports("x86-64-v3") ? VectorWidth::k256
                                                                          : VectorWidth::kBaseline;
  const VectorWidth limit = vector_width_limit.load(std::memory_order_relaxed);
  return widest < limit ? widest : limit;
#else
  return VectorWidth::kBaseline;
#endif
}

// a * b + c, rounded once on every machine.
AMHEX_HD inline float FusedMultiplyAdd(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
  return fmaf(a, b, c);
#else
  return __builtin_fmaf(a, b, c);
#endif
}

// Written so that each becomes one instruction, or none; NaN never reaches them.
AMHEX_HD inline float AbsoluteValue(float a) {
#if defined(__CUDA_ARCH__)
  return fabsf(a);
#else
  return __builtin_fabsf(a);
#endif
}
AMHEX_HD inline float Larger(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fmaxf(a, b);
#else
  return a > b ? a : b;
#endif
}
AMHEX_HD inline float Smaller(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fminf(a, b);
#else
  return a < b ? a : b;
#endif
}

template <class T>
AMHEX_HD constexpr T Larger(T a, T b) {
  return a > b ? a : b;
}

template <class T>
AMHEX_HD constexpr T Smaller(T a, T b) {
  return a < b ? a : b;
}

template <class T>
AMHEX_HD constexpr T Clamped(T value, T low, T high) {
  return value < low ? low : (value > high ? high : value);
}

AMHEX_HD inline int32_t CountBits(uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __popc(bits);
#else
  return __builtin_popcount(bits);
#endif
}

// Number of the lowest bit that is set; `bits` is not zero.
AMHEX_HD inline int LowestBit(uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __ffs(static_cast<int>(bits)) - 1;
#else
  return __builtin_ctz(bits);
#endif
}

AMHEX_HD inline void AtomicAdd(int64_t* target, int64_t value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(reinterpret_cast<unsigned long long*>(target), static_cast<unsigned long long>(value));
#else
  __atomic_fetch_add(target, value, __ATOMIC_RELAXED);
#endif
}

AMHEX_HD inline void AtomicAdd(int32_t* target, int32_t value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(target, value);
#else
  __atomic_fetch_add(target, value, __ATOMIC_RELAXED);
#endif
}

// Unit vector along float `a`; the zero vector stays zero. Square root and division are the IEEE
// ones, so host and device agree.
AMHEX_HD inline Vec3f UnitVector(const Vec3f& a) {
  const float length = sqrtf(Dot(a, a));
  return length > 0.0f ? a / length : a;
}

template <class T>
AMHEX_HD constexpr Vec3f ToFloat(const Vec3<T>& a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

template <class T>
AMHEX_HD constexpr Vec3d ToDouble(const Vec3<T>& a) {
  return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)};
}

}  // namespace amhex
