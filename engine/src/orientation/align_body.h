// Maintaining orientations (section 4.3): every site aligns to the distance-weighted combination
// of its neighbours, invariant to axis permutations (the extrinsic energy of Jakob et al. 2015),
// and to the hull where it is near.
#pragma once

#include <cstdint>

#include "base/quat.h"
#include "graph/bin_grid.h"
#include "graph/knn_graph.h"
#include "orientation/octahedral_match.h"
#include "orientation/propagate_body.h"

namespace amhex {

// Samples act on sites nearer than this, edge lengths: the layer of cells at the hull.
inline constexpr float kHullInfluence = 0.9f;
// Weight of a site's own frame beside its neighbours' (which sum to about 4 in a grid): damps the
// simultaneous update.
inline constexpr float kOwnFrameWeight = 0.5f;
// Share of the hull in the frame of a site that it influences fully.
inline constexpr float kHullShare = 0.85f;
// The hull's pull depends on which axis is nearest to it, so it is applied twice.
inline constexpr int kHullPasses = 2;

// Reads `before` and writes `after`, so the result does not depend on the order of evaluation.
struct AlignBody {
  ArrayView<const Vec3f> position;      // [site_count]
  ArrayView<const int32_t> neighbours;  // [site_count][26]
  BinGrid sample_bins;                  // over sample_position; no points = no hull
  ArrayView<const Vec3f> sample_position;
  ArrayView<const Vec3f> sample_normal;  // [sample_count] unit
  ArrayView<const Quatf> before;
  ArrayView<Quatf> after;

  AMHEX_HD void operator()(int64_t site) const {
    Quatf sum = before[site] * kOwnFrameWeight;
    // Two are read at a time, so that a device waits half as often.
    static_assert(kNeighbourCount % 2 == 0);
    for (int slot = 0; slot < kNeighbourCount; slot += 2) {
      const int32_t first = neighbours[site * kNeighbourCount + slot];
      const int32_t second = neighbours[site * kNeighbourCount + slot + 1];
      if (first == kNoNode) break;
      const int32_t last = second == kNoNode ? first : second;
      const float first_distance = SquaredDistance(position[first], position[site]);
      const float last_distance = SquaredDistance(position[last], position[site]);
      const Quatf first_frame = before[first], last_frame = before[last];
      sum = sum + MatchTo(sum, first_frame) * DistanceWeight(first_distance);
      if (second == kNoNode) break;
      sum = sum + MatchTo(sum, last_frame) * DistanceWeight(last_distance);
    }
    Quatf frame = Normalized(sum);
    if (!sample_bins.ids.empty()) {
      for (int pass = 0; pass < kHullPasses; ++pass) frame = PulledToHull(position[site], frame);
    }
    after[site] = frame;
  }

  // Each near sample asks for the frame turned so that one axis is its normal; tangents stay free
  // (appendix B.6).
  AMHEX_HD Quatf PulledToHull(const Vec3f& centre, const Quatf& frame) const {
    Quatf sum{0, 0, 0, 0};
    float nearest = kHullInfluence * kHullInfluence;
    VisitNear(sample_bins, centre, kHullInfluence, [&](int32_t sample) {
      const float d = SquaredDistance(sample_position[sample], centre);
      if (d >= kHullInfluence * kHullInfluence) return;
      if (d < nearest) nearest = d;
      const Quatf turned = TurnNearestAxisTo(frame, sample_normal[sample]);
      const Quatf same_sign = Dot(turned, frame) < 0 ? -turned : turned;
      sum = sum + same_sign * DistanceWeight(4.0f * d);
    });
    const float share = kHullShare * (1.0f - nearest / (kHullInfluence * kHullInfluence));
    if (!(share > 0)) return frame;
    return Normalized(Normalized(sum) * share + frame * (1.0f - share));
  }
};

}  // namespace amhex
