// N_6 of section 4.2: the best neighbour at an edge length's distance in each axis direction.
//
//            3 (+y)
//            |  5 (+z)
//            | /
//   0 (-x) --i-- 1 (+x)      direction ^ 1 is the opposite one
//          / |
//    4 (-z)  2 (-y)
#pragma once

#include <cstdint>

#include "base/quat.h"
#include "graph/knn_graph.h"

namespace amhex {

inline constexpr int kAxisDirectionCount = 6;
// Above every squared distance between nodes.
inline constexpr float kUnreachableDistance = 3e38f;

// eq. 1. Neighbours from `volume_site_count` on are hull samples and never chosen (section 4.4).
// Ties go to the smaller id.
struct AxisNeighbourBody {
  ArrayView<const Vec3f> position;      // [node_count]
  ArrayView<const Quatf> orientation;   // [volume_site_count] unit
  ArrayView<const Vec3f> size;          // [volume_site_count] e of eq. 1 along each axis
  ArrayView<const int32_t> is_inside;   // [volume_site_count]; empty: both sides are one
  ArrayView<const int32_t> neighbours;  // [volume_site_count][26]
  int64_t volume_site_count = 0;
  ArrayView<int32_t> axis_neighbours;  // [volume_site_count][6] or kNoNode

  AMHEX_HD void operator()(int64_t site) const {
    Vec3f target[kAxisDirectionCount];
    float nearest[kAxisDirectionCount];
    int32_t* chosen = &axis_neighbours[site * kAxisDirectionCount];
    for (int direction = 0; direction < kAxisDirectionCount; ++direction) {
      target[direction] =
          position[site] + DirectionOf(orientation[site], direction) * size[site][direction / 2];
      nearest[direction] = kUnreachableDistance;
      chosen[direction] = kNoNode;
    }
    for (int slot = 0; slot < kNeighbourCount; ++slot) {
      const int32_t other = neighbours[site * kNeighbourCount + slot];
      if (other == kNoNode || other >= volume_site_count) continue;
      // deviates: a site beyond the hull is never in phase with this one; the hull itself takes
      // its place (regularize_body.h).
      if (!is_inside.empty() && is_inside[other] != is_inside[site]) continue;
      const Vec3f at = position[other];
      for (int direction = 0; direction < kAxisDirectionCount; ++direction) {
        const float d = SquaredDistance(at, target[direction]);
        if (d < nearest[direction] || (d == nearest[direction] && other < chosen[direction])) {
          chosen[direction] = other;
          nearest[direction] = d;
        }
      }
    }
  }
};

// How many sites claim each site as neighbour: the cluster size of section 4.4.
struct CountClaimsBody {
  ArrayView<const int32_t> axis_neighbours;
  ArrayView<int32_t> claim_count;  // [volume_site_count], zero before

  AMHEX_HD void operator()(int64_t site) const {
    for (int direction = 0; direction < kAxisDirectionCount; ++direction) {
      const int32_t other = axis_neighbours[site * kAxisDirectionCount + direction];
      if (other != kNoNode) AtomicAdd(&claim_count[other], 1);
    }
  }
};

}  // namespace amhex
