// eq. 2: how many steps of the graph lead from a node to the closest hull sample.
#pragma once

#include <cstdint>

#include "graph/knn_graph.h"

namespace amhex {

inline constexpr int32_t kUnreached = 1 << 30;

// One wave: nodes without a distance take one more than the smallest among their neighbours. Reads
// `before`, writes `after`; repeated until nothing changes. Samples stay at 0.
struct HopDistanceBody {
  ArrayView<const int32_t> neighbours;  // [volume_site_count][26]
  ArrayView<const int32_t> before;      // [node_count]
  ArrayView<int32_t> after;             // [node_count]

  AMHEX_HD void operator()(int64_t site) const {
    int32_t nearest = before[site];
    for (int slot = 0; slot < kNeighbourCount; ++slot) {
      const int32_t other = neighbours[site * kNeighbourCount + slot];
      if (other != kNoNode && before[other] + 1 < nearest) nearest = before[other] + 1;
    }
    after[site] = nearest;
  }
};

// 0 for samples, unreached for volume sites.
struct HopStartBody {
  int64_t volume_site_count = 0;
  ArrayView<int32_t> hop_distance;

  AMHEX_HD void operator()(int64_t node) const {
    hop_distance[node] = node < volume_site_count ? kUnreached : 0;
  }
};

// 1 where a wave changed a node.
struct HopChangedBody {
  ArrayView<const int32_t> before;
  ArrayView<const int32_t> after;

  AMHEX_HD int64_t operator()(int64_t site) const { return before[site] != after[site] ? 1 : 0; }
};

}  // namespace amhex
