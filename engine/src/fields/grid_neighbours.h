// How the neighbours of a node of the background grid are numbered and weighed.
#pragma once

#include "amhex/vec3.h"

namespace amhex::fields {

inline constexpr int kNeighbourCount = 18;
inline constexpr int kForwardCount = 9;  // neighbours k and k + 9 lie opposite each other

AMHEX_HD inline constexpr int Opposite(int k) {
  return k < kForwardCount ? k + kForwardCount : k - kForwardCount;
}
AMHEX_HD inline constexpr bool IsAxisNeighbour(int k) { return k % kForwardCount < 3; }

// How far neighbour k lies along an axis, in cells: 0..2 along +x +y +z, 3..8 face diagonals, 9..17
// their negatives.
AMHEX_HD inline constexpr int NeighbourOffset(int k, int axis) {
  const int forward = k % kForwardCount;
  const int sign = k < kForwardCount ? 1 : -1;
  if (forward < 3) return axis == forward ? sign : 0;
  const int plane = (forward - 3) / 2;  // xy, xz, yz
  const int first = plane == 2 ? 1 : 0, second = plane == 0 ? 1 : 2;
  if (axis == first) return sign;
  if (axis != second) return 0;
  return (forward - 3) % 2 == 0 ? sign : -sign;
}

// On the finest level.
inline constexpr float kAxisWeight = 1.0F;
inline constexpr float kDiagonalWeight = 0.5F;

}  // namespace amhex::fields
