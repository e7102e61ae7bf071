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

// On the finest level.
inline constexpr float kAxisWeight = 1.0F;
inline constexpr float kDiagonalWeight = 0.5F;

}  // namespace amhex::fields
