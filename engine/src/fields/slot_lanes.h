// One number of each of the eight nodes of a cube (node_slots.h) in lanes; lane bits are the node's
// place along x, y, z.
//
// Used inside of RunWithWidestVectors (base/vector_lanes.h).
#pragma once

#include <cstdint>

#include "base/vector_lanes.h"
#include "fields/linear_operators.h"
#include "fields/octahedral_group.h"

namespace amhex::fields {

using SlotLanes = FloatLanes;
using SlotMask = FloatMask;
static_assert(kCubeSlots == kLanes);

// What the nodes one step ahead along an axis have: `own` is the cube's, `next` that of the cube
// ahead.
template <int kAxis>
AMHEX_LANES_INLINE SlotLanes OneAhead(const SlotLanes& own, const SlotLanes& next) {
  if constexpr (kAxis == 0) {
    return __builtin_shufflevector(own, next, 1, 8, 3, 10, 5, 12, 7, 14);
  } else if constexpr (kAxis == 1) {
    return __builtin_shufflevector(own, next, 2, 3, 8, 9, 6, 7, 12, 13);
  } else {
    return __builtin_shufflevector(own, next, 4, 5, 6, 7, 8, 9, 10, 11);
  }
}
template <int kAxis>
AMHEX_LANES_INLINE SlotLanes OneBehind(const SlotLanes& own, const SlotLanes& previous) {
  if constexpr (kAxis == 0) {
    return __builtin_shufflevector(own, previous, 9, 0, 11, 2, 13, 4, 15, 6);
  } else if constexpr (kAxis == 1) {
    return __builtin_shufflevector(own, previous, 10, 11, 0, 1, 14, 15, 4, 5);
  } else {
    return __builtin_shufflevector(own, previous, 12, 13, 14, 15, 0, 1, 2, 3);
  }
}

// Where bit `lane` of `bits` is set.
AMHEX_LANES_INLINE SlotMask MaskOfBits(uint8_t bits) {
  constexpr SlotMask kBit = {1, 2, 4, 8, 16, 32, 64, 128};
  return (kBit & static_cast<int32_t>(bits)) != 0;
}

// AxisRotation::Apply and ApplyInverse of one lane of the numbers of three axes.
AMHEX_LANES_INLINE void ApplyToLane(const AxisRotation& rotation, int lane, SlotLanes* v) {
  const Vec3f old = {v[0][lane], v[1][lane], v[2][lane]};
  for (int a = 0; a < 3; ++a) {
    v[a][lane] = static_cast<float>(rotation.sign[a]) * old[rotation.source[a]];
  }
}
AMHEX_LANES_INLINE void ApplyInverseToLane(const AxisRotation& rotation, int lane, SlotLanes* v) {
  const Vec3f old = {v[0][lane], v[1][lane], v[2][lane]};
  for (int a = 0; a < 3; ++a) {
    v[rotation.source[a]][lane] = static_cast<float>(rotation.sign[a]) * old[a];
  }
}

}  // namespace amhex::fields
