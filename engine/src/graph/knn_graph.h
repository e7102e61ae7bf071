// N_26 of section 4.2: every node's nearest neighbours.
//
// Layout: [node_count][26] ids, ascending by (distance, id); kNoNode fills rows of small graphs.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "base/platform.h"

namespace amhex {

// 3 x 3 x 3 - 1 cubes stacked around one (section 4.2).
inline constexpr int kNeighbourCount = 26;
inline constexpr int32_t kNoNode = -1;

AMHEX_HD inline float SquaredDistance(const Vec3f& a, const Vec3f& b) {
  const Vec3f d = a - b;
  return Dot(d, d);
}

// The nearest nodes seen so far, ascending by (squared distance, id).
struct NearestNodes {
  int count = 0;
  float squared_distance[kNeighbourCount];
  int32_t id[kNeighbourCount];

  AMHEX_HD bool IsFull() const { return count == kNeighbourCount; }
  AMHEX_HD bool Precedes(float d, int32_t node, int slot) const {
    return d < squared_distance[slot] || (d == squared_distance[slot] && node < id[slot]);
  }

  // Each node must be offered at most once.
  AMHEX_HD void Offer(float d, int32_t node) {
    if (IsFull() && !Precedes(d, node, kNeighbourCount - 1)) return;
    int slot = IsFull() ? kNeighbourCount - 1 : count++;
    while (slot > 0 && Precedes(d, node, slot - 1)) {
      squared_distance[slot] = squared_distance[slot - 1];
      id[slot] = id[slot - 1];
      --slot;
    }
    squared_distance[slot] = d;
    id[slot] = node;
  }

  AMHEX_HD bool Contains(int32_t node) const {
    for (int slot = 0; slot < count; ++slot) {
      if (id[slot] == node) return true;
    }
    return false;
  }

  AMHEX_HD void WriteTo(int32_t* row) const {
    for (int slot = 0; slot < kNeighbourCount; ++slot)
      row[slot] = slot < count ? id[slot] : kNoNode;
  }
};

}  // namespace amhex
