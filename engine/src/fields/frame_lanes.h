// The three numbers of a node, one per axis, in lanes; renaming the axes is one shuffle.
//
// Lanes are used inside of RunWithWidestVectors (base/vector_lanes.h); results are those of the
// same operations on one number after the other, to the bit.
#pragma once

#include <array>
#include <cstdint>

#include "base/vector_lanes.h"
#include "fields/octahedral_group.h"

namespace amhex::fields {

// One number per axis; the fourth lane is not used.
using AxisLanes = float __attribute__((vector_size(16), aligned(alignof(float))));
// A complex number per axis, real parts in the even lanes; the last two lanes are not used.
using PhaseLanes = FloatLanes;
using PhaseLaneNumbers = FloatMask;

AMHEX_LANES_INLINE AxisLanes LoadAxes(const float* from) {
  const AxisLanes lanes = {from[0], from[1], from[2], 0};
  return lanes;
}
// Of the six numbers of a node: others may be written at the same time.
using FourOfPhases __attribute__((aligned(alignof(float)))) =
    float __attribute__((vector_size(16)));
using TwoOfPhases __attribute__((aligned(alignof(float)))) = float __attribute__((vector_size(8)));
AMHEX_LANES_INLINE PhaseLanes LoadPhases(const float* from) {
  const FourOfPhases low = *reinterpret_cast<const FourOfPhases*>(from);
  const TwoOfPhases two = *reinterpret_cast<const TwoOfPhases*>(from + 4);
  const FourOfPhases high = __builtin_shufflevector(two, two, 0, 1, -1, -1);
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, -1, -1);
}
AMHEX_LANES_INLINE void StorePhases(const PhaseLanes& lanes, float* to) {
  *reinterpret_cast<FourOfPhases*>(to) = __builtin_shufflevector(lanes, lanes, 0, 1, 2, 3);
  *reinterpret_cast<TwoOfPhases*>(to + 4) = __builtin_shufflevector(lanes, lanes, 4, 5);
}

// Calls body(i) for i in [begin, end), a body that works with lanes.
template <class Body>
void ForEachInLanes(int64_t begin, int64_t end, const Body& body) {
  RunWithWidestVectors([&] {
    for (int64_t i = begin; i < end; ++i) body(i);
  });
}

// An AxisRotation (octahedral_group.h) for lanes: where each lane's number comes from, and signs.
struct LaneRotation {
  PhaseLaneNumbers phase_source;   // of Apply
  PhaseLaneNumbers phase_inverse;  // of ApplyInverse
  PhaseLanes conjugation;  // -1 in the imaginary lanes of axes that oppose, by the node's own axes
};
// By code, as kAxisRotations.
const std::array<LaneRotation, kRotationCount>& LaneRotations();

// result[lane] = lanes[numbers[lane]].
template <class Lanes, class Numbers>
AMHEX_LANES_INLINE Lanes Shuffled(const Lanes& lanes, const Numbers& numbers) {
#if defined(__clang__)
  Lanes result{};
  for (size_t lane = 0; lane < sizeof(Lanes) / sizeof(float); ++lane) {
    result[lane] = lanes[numbers[lane]];
  }
  return result;
#else
  return __builtin_shuffle(lanes, numbers);
#endif
}

}  // namespace amhex::fields
