// Stateless random numbers: the value is a hash of (seed, stream, index), so that it depends on
// neither the order of evaluation nor the machine.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"

namespace amhex {

// A different stream for every use, so that two uses never see the same numbers.
enum class RandomStream : uint64_t {
  kKnnStart = 1,
  kGridJitter = 2,
  kSampleAcross = 3,  // where a hull sample lies in its triangle, two numbers
  kSampleAlong = 4,
  kSampleOrder = 5,
  kEdgeBalance = 6,
};

// 64 well mixed bits (the finaliser of SplitMix64, applied per input word).
AMHEX_HD constexpr uint64_t RandomBits(uint64_t seed, RandomStream stream, uint64_t index) {
  uint64_t state = seed;
  const uint64_t words[2] = {static_cast<uint64_t>(stream), index};
  for (const uint64_t word : words) {
    state += 0x9e3779b97f4a7c15ULL + word;
    state = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9ULL;
    state = (state ^ (state >> 27)) * 0x94d049bb133111ebULL;
    state ^= state >> 31;
  }
  return state;
}

// Uniform in [0, 1).
AMHEX_HD constexpr double RandomUnit(uint64_t seed, RandomStream stream, uint64_t index) {
  return static_cast<double>(RandomBits(seed, stream, index) >> 11) * 0x1.0p-53;
}

}  // namespace amhex
