// What the kernels of the labelling have in common: warps, their votes, and the shapes of the work.
//
// Uses CUDA's own words only, so that the tests can run it on the host.
#pragma once

#include <bit>
#include <cstdint>

#include "relax/label_body.h"
#include "relax/label_groups.h"

// Loops of one or two rounds stay rolled: copies would only crowd the instruction cache.
#if defined(__CUDACC__)
#define AMHEX_ROLLED _Pragma("unroll 1")
#define AMHEX_UNROLLED _Pragma("unroll")
#else
#define AMHEX_ROLLED
#define AMHEX_UNROLLED
#endif

namespace amhex {

inline constexpr int kWarpWidth = 32;
inline constexpr unsigned kWholeWarp = 0xffffffffu;
static_assert(kBlockPoints == kWarpWidth, "a lane has a point of a block");

// What a multiprocessor holds at most: thread blocks, and warps of 64 registers per thread.
#if defined(__CUDA_ARCH__) && (__CUDA_ARCH__ < 800 || __CUDA_ARCH__ == 860)
inline constexpr int kMostThreadBlocks = 16;
#elif defined(__CUDA_ARCH__) && __CUDA_ARCH__ == 890
inline constexpr int kMostThreadBlocks = 24;
#else
inline constexpr int kMostThreadBlocks = 32;
#endif
inline constexpr int kMostWarps = 32;

__device__ inline int LaneOfThread() { return static_cast<int>(threadIdx.x) % kWarpWidth; }
__device__ inline int WarpOfThread() { return static_cast<int>(threadIdx.x) / kWarpWidth; }

// The same number, of which the compiler knows nothing: it is kept as it is, and what is worked out
// from it takes no register before it is needed.
template <class T>
__device__ inline T NotKnownAhead(T number) {
  static_assert(sizeof(T) == sizeof(int32_t));
  asm volatile("" : "+r"(number));
  return number;
}

// 1 << places; 0 from 32 places on.
__device__ inline uint32_t OneShifted(uint32_t places) {
#if defined(__CUDA_ARCH__)
  return __funnelshift_lc(0, 1, places);
#else
  return places < kWarpWidth ? 1u << places : 0u;
#endif
}

// The least of all lanes' numbers, none of them negative: their bits ascend with them.
__device__ inline float LeastOfWarp(float value) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
  AMHEX_UNROLLED
  for (int step = kWarpWidth / 2; step > 0; step /= 2) {
    value = Smaller(value, __shfl_xor_sync(kWholeWarp, value, step));
  }
  return value;
#else
  return std::bit_cast<float>(__reduce_min_sync(kWholeWarp, std::bit_cast<uint32_t>(value)));
#endif
}

__device__ inline uint32_t UnionOfWarp(uint32_t bits) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
  AMHEX_UNROLLED
  for (int step = kWarpWidth / 2; step > 0; step /= 2) {
    bits |= __shfl_xor_sync(kWholeWarp, bits, step);
  }
  return bits;
#else
  return __reduce_or_sync(kWholeWarp, bits);
#endif
}

__device__ inline uint32_t SumOfWarp(uint32_t value) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
  AMHEX_UNROLLED
  for (int step = kWarpWidth / 2; step > 0; step /= 2) {
    value += __shfl_xor_sync(kWholeWarp, value, step);
  }
  return value;
#else
  return __reduce_add_sync(kWholeWarp, value);
#endif
}

// What is known of each group: the sites that may own its points, where these are found beforehand,
// and what the labelling leaves.
struct GroupLists {
  ArrayView<int32_t> slots;  // [group_count][kFineCapacity] of the bins, by ascending ids
  ArrayView<int32_t> count;  // [group_count] or kTooMany
  ArrayView<float> reach;    // [group_count] that was searched (LabelTileBody::Search)
  ArrayView<uint32_t>
      next_reach;            // [group_count] that was needed, its bits; 0 before the first time
  ArrayView<uint32_t> left;  // [group_count] bit t: tile t is not labelled, its list would not do
};
inline constexpr int32_t kTooMany = -1;

// The cube of a group's points. With one tile it is that tile.
__device__ inline LabelTileBody::Search SearchOf(const LabelGroup& group, int tiles) {
  LabelTileBody::Search search;
  search.base = group.base;
  search.half_width =
      0.5f * static_cast<float>((tiles == 1 ? 1 : kGroupWidthInTiles) * kTileWidth - 1);
  search.centre = CentreOfCube(group.base, search.half_width);
  search.is_inside = group.is_inside;
  search.limit = group.is_inside != 0 ? kUnboundedReach : kOutsideReach;
  search.reach = 0;
  return search;
}

// From the group's base to that of its tile.
__device__ inline LatticePoint TileInGroup(int octant) {
  constexpr int kScale = kTileWidth / kBlockWidth;
  const LatticePoint half = BlockInTile(octant);
  return {half.x * kScale, half.y * kScale, half.z * kScale};
}

}  // namespace amhex
