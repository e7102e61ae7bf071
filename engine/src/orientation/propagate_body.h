// Orientation initialization of section 4.3: frames travel from the hull samples into the volume
// as a wave front over the hop distance.
#pragma once

#include <cstdint>

#include "base/quat.h"
#include "graph/hop_distance_body.h"
#include "graph/knn_graph.h"
#include "orientation/octahedral_match.h"

namespace amhex {

// Weight of a neighbour: falls with the real distance (edge lengths), rational so that host and
// device agree to the bit.
AMHEX_HD inline float DistanceWeight(float squared_distance) {
  const float base = 1.0f + squared_distance;
  return 1.0f / (base * base);
}

// One wave: sites of hop distance `wave` combine the frames of their neighbours in N_26 that are
// closer to the hull, weighted by real and by hop distance. Earlier waves must be complete.
struct PropagateBody {
  int32_t wave = 1;
  ArrayView<const Vec3f> position;        // [node_count] volume sites, then samples
  ArrayView<const int32_t> hop_distance;  // [node_count] eq. 2
  ArrayView<const int32_t> neighbours;    // [volume_site_count][26]
  ArrayView<Quatf> orientation;           // [node_count] unit; samples are given

  AMHEX_HD void operator()(int64_t site) const {
    if (hop_distance[site] != wave) return;
    Quatf sum{0, 0, 0, 0};
    bool is_first = true;
    for (int slot = 0; slot < kNeighbourCount; ++slot) {
      const int32_t other = neighbours[site * kNeighbourCount + slot];
      if (other == kNoNode || hop_distance[other] >= wave) continue;
      const float weight = DistanceWeight(SquaredDistance(position[other], position[site])) /
                           static_cast<float>(1 + hop_distance[other]);
      const Quatf frame = is_first ? orientation[other] : MatchTo(sum, orientation[other]);
      sum = sum + frame * weight;
      is_first = false;
    }
    if (!is_first) orientation[site] = Normalized(sum);
  }
};

}  // namespace amhex
