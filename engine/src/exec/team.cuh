// Threads of a CUDA device that do one thing together.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>

#include "amhex/vec3.h"
#include "base/platform.h"

namespace amhex {

// Neighbouring lanes of a warp that do the same work but for what they share out. All of them must
// come to every call.
class Team {
 public:
  // A whole warp: several teams of one would go ways of their own, one after the other.
  static constexpr int kWidth = 32;

  __device__ Team() : lane_(static_cast<int>(threadIdx.x) % kLanesPerWarp) {}
  // 0 .. kWidth-1
  __device__ int rank() const { return lane_ % kWidth; }

  // What the thread of this rank has.
  template <class T>
  __device__ T From(int rank, T value) const {
    return __shfl_sync(mask(), value, first() + rank);
  }
  __device__ Vec3d From(int rank, const Vec3d& value) const {
    return {From(rank, value.x), From(rank, value.y), From(rank, value.z)};
  }
  // Bit r: what the thread of rank r says.
  __device__ unsigned Vote(bool value) const { return __ballot_sync(mask(), value) >> first(); }
  __device__ bool IsAny(bool value) const { return Vote(value) != 0; }
  // What the thread has whose rank differs in these bits.
  template <class T>
  __device__ T Across(T value, int bits) const {
    return __shfl_xor_sync(mask(), value, bits);
  }
  // What others wrote to memory before they came here can be read.
  __device__ void Meet() const { __syncwarp(mask()); }
  __device__ double Least(double value) const {
    for (int step = 1; step < kWidth; step *= 2) value = Smaller(value, Across(value, step));
    return value;
  }
  __device__ uint32_t Least(uint32_t value) const {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
    for (int step = 1; step < kWidth; step *= 2) value = Smaller(value, Across(value, step));
    return value;
#else
    return __reduce_min_sync(mask(), value);
#endif
  }

 private:
  static constexpr int kLanesPerWarp = 32;

  __device__ int first() const { return lane_ / kWidth * kWidth; }
  __device__ unsigned mask() const { return ~0U >> (kLanesPerWarp - kWidth) << first(); }

  int lane_;
};

}  // namespace amhex
