// N_26 as the paper builds it (section 4.2; Dong et al. 2011): from random neighbours, every node
// repeatedly keeps the nearest among its neighbours and their neighbours.
//
// The engine runs knn_exact_body.h; this one is kept as the method's reference.
#pragma once

#include <cstdint>

#include "base/counter_rng.h"
#include "graph/knn_graph.h"

namespace amhex {

// Steps after which a random start has become an almost perfect graph (section 4.2).
inline constexpr int kKnnUpdatesFromRandom = 7;

// Fills a row with random nodes, sorted as every row is. Needs more than 26 nodes.
struct KnnRandomBody {
  uint64_t seed = 1;
  int64_t node_count = 0;
  ArrayView<const Vec3f> position;
  ArrayView<int32_t> neighbours;

  AMHEX_HD void operator()(int64_t node) const {
    NearestNodes chosen;
    for (uint64_t attempt = 0; !chosen.IsFull(); ++attempt) {
      const uint64_t index = (static_cast<uint64_t>(node) << 20) + attempt;
      const auto other = static_cast<int32_t>(RandomBits(seed, RandomStream::kKnnStart, index) %
                                              static_cast<uint64_t>(node_count));
      if (other == node || chosen.Contains(other)) continue;
      chosen.Offer(SquaredDistance(position[other], position[node]), other);
    }
    chosen.WriteTo(&neighbours[node * kNeighbourCount]);
  }
};

// One update from `before` to `after`: the nearest of N_k and of N_k^2 (section 4.2).
struct KnnUpdateBody {
  ArrayView<const Vec3f> position;
  ArrayView<const int32_t> before;
  ArrayView<int32_t> after;

  AMHEX_HD void operator()(int64_t node) const {
    NearestNodes nearest;
    for (int slot = 0; slot < kNeighbourCount; ++slot) {
      const int32_t neighbour = before[node * kNeighbourCount + slot];
      if (neighbour == kNoNode) continue;
      Consider(static_cast<int32_t>(node), neighbour, nearest);
      for (int second = 0; second < kNeighbourCount; ++second) {
        const int32_t other = before[static_cast<int64_t>(neighbour) * kNeighbourCount + second];
        if (other != kNoNode) Consider(static_cast<int32_t>(node), other, nearest);
      }
    }
    nearest.WriteTo(&after[node * kNeighbourCount]);
  }

  AMHEX_HD void Consider(int32_t node, int32_t other, NearestNodes& nearest) const {
    if (other == node) return;
    const float d = SquaredDistance(position[other], position[node]);
    if (nearest.IsFull() && !nearest.Precedes(d, other, kNeighbourCount - 1)) return;
    if (!nearest.Contains(other)) nearest.Offer(d, other);
  }
};

}  // namespace amhex
