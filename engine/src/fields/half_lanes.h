// One number of each of the four even or odd slots of a cube (linear_operators.h) in lanes. What is
// next to the even ones is odd and the other way round.
//
// Used inside of RunWithWidestVectors (base/vector_lanes.h).
#pragma once

#include <array>
#include <cstdint>

#include "base/vector_lanes.h"
#include "fields/linear_operators.h"

namespace amhex::fields {

using HalfLanesOfCube = float __attribute__((vector_size(16), aligned(alignof(float))));
static_assert(sizeof(HalfLanesOfCube) == kHalfSlots * sizeof(float));

// As LoadFloats and StoreFloats (base/vector_lanes.h).
using HalfAmongNumbers __attribute__((aligned(alignof(float)))) = HalfLanesOfCube;
AMHEX_LANES_INLINE HalfLanesOfCube LoadHalf(const float* from) {
  return *reinterpret_cast<const HalfAmongNumbers*>(from);
}
AMHEX_LANES_INLINE void StoreHalf(const HalfLanesOfCube& lanes, float* to) {
  *reinterpret_cast<HalfAmongNumbers*>(to) = lanes;
}

// What the slots one step ahead of the even (odd) ones along an axis have: `own` are the odd (even)
// ones of the cube, `next` those of the cube ahead. Their lanes along x are the same, along y those
// of the other pair's half, along z those of the other pair.
template <int kAxis, bool kIsOdd>
AMHEX_LANES_INLINE HalfLanesOfCube HalfAhead(const HalfLanesOfCube& own,
                                             const HalfLanesOfCube& next) {
  if constexpr (kAxis == 0 && !kIsOdd) {
    return __builtin_shufflevector(own, next, 0, 5, 6, 3);
  } else if constexpr (kAxis == 0) {
    return __builtin_shufflevector(own, next, 4, 1, 2, 7);
  } else if constexpr (kAxis == 1) {
    return __builtin_shufflevector(own, next, 1, 4, 3, 6);
  } else {
    return __builtin_shufflevector(own, next, 2, 3, 4, 5);
  }
}
template <int kAxis, bool kIsOdd>
AMHEX_LANES_INLINE HalfLanesOfCube HalfBehind(const HalfLanesOfCube& own,
                                              const HalfLanesOfCube& previous) {
  if constexpr (kAxis == 0 && !kIsOdd) {
    return __builtin_shufflevector(own, previous, 4, 1, 2, 7);
  } else if constexpr (kAxis == 0) {
    return __builtin_shufflevector(own, previous, 0, 5, 6, 3);
  } else if constexpr (kAxis == 1) {
    return __builtin_shufflevector(own, previous, 5, 0, 7, 2);
  } else {
    return __builtin_shufflevector(own, previous, 6, 7, 0, 1);
  }
}

}  // namespace amhex::fields
