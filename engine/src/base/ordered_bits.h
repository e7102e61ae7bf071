// Numbers as integers of the same order, and the least and largest of those that many write at
// once: the order of writing cannot matter.
#pragma once

#include <bit>
#include <cstdint>

#include "base/platform.h"

namespace amhex {

// A number's bits such that they are in the order of the numbers; both zeros are one. NaN never
// reaches this.
AMHEX_HD inline uint64_t OrderedBits(double value) {
  constexpr uint64_t kSign = uint64_t{1} << 63;
  const auto bits = std::bit_cast<uint64_t>(value + 0.0);
  return (bits & kSign) != 0 ? ~bits : bits | kSign;
}
AMHEX_HD inline double NumberOfOrder(uint64_t ordered) {
  constexpr uint64_t kSign = uint64_t{1} << 63;
  return std::bit_cast<double>((ordered & kSign) != 0 ? ordered & ~kSign : ~ordered);
}

// What is there may be read first: it only ever falls, or rises.
AMHEX_HD inline void AtomicMin(uint64_t* target, uint64_t value) {
#if defined(__CUDA_ARCH__)
  if (value < *static_cast<const volatile uint64_t*>(target)) {
    atomicMin(reinterpret_cast<unsigned long long*>(target),
              static_cast<unsigned long long>(value));
  }
#else
  uint64_t known = __atomic_load_n(target, __ATOMIC_RELAXED);
  while (value < known && !__atomic_compare_exchange_n(target, &known, value, true,
                                                       __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}
AMHEX_HD inline void AtomicMax(uint64_t* target, uint64_t value) {
#if defined(__CUDA_ARCH__)
  if (value > *static_cast<const volatile uint64_t*>(target)) {
    atomicMax(reinterpret_cast<unsigned long long*>(target),
              static_cast<unsigned long long>(value));
  }
#else
  uint64_t known = __atomic_load_n(target, __ATOMIC_RELAXED);
  while (value > known && !__atomic_compare_exchange_n(target, &known, value, true,
                                                       __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}

}  // namespace amhex
