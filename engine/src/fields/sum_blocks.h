// How sums of many numbers are cut into partial sums: part of their bits, on every machine.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"

namespace amhex::fields {

// Elements per partial sum; never derived from the number of threads.
inline constexpr int64_t kSumBlock = 4096;
// Where terms come four at a time, a block has that many interleaved sums; what is left over at
// its end belongs to the first. The block's sum is (first + second) + (third + fourth).
inline constexpr int64_t kSumLanes = 4;

AMHEX_HD constexpr int64_t SumBlocks(int64_t count) { return (count + kSumBlock - 1) / kSumBlock; }

}  // namespace amhex::fields
