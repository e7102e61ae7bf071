// How sums of many numbers are cut into partial sums: part of their bits, on every machine.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"

namespace amhex::fields {

// Elements per partial sum; never derived from the number of threads.
inline constexpr int64_t kSumBlock = 4096;

AMHEX_HD constexpr int64_t SumBlocks(int64_t count) { return (count + kSumBlock - 1) / kSumBlock; }

// The sums of conjugate gradients are cut by nodes, so that a block of the matrix' product is added
// up while it is in the cache. A block has eight interleaved sums; what is left over at the end of
// the last one belongs to the first.
inline constexpr int64_t kNodesPerSum = 512;
inline constexpr int64_t kSumLanes = 8;

AMHEX_HD constexpr int64_t NodeSumBlocks(int64_t node_count) {
  return (node_count + kNodesPerSum - 1) / kNodesPerSum;
}
// A block's sum of its interleaved ones.
template <class Sums>
AMHEX_HD constexpr double SumOfLanes(const Sums& s) {
  return ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
}
// The same of its halves.
template <class Sums>
AMHEX_HD constexpr double SumOfLanes(const Sums& low, const Sums& high) {
  return ((low[0] + low[1]) + (low[2] + low[3])) + ((high[0] + high[1]) + (high[2] + high[3]));
}

}  // namespace amhex::fields
