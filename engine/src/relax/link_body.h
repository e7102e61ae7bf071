// Which faces of neighbouring cells look at each other: the mutual links of N_6, and the faces
// that look at the hull.
#pragma once

#include <cstdint>

#include "base/quat.h"
#include "graph/n6_body.h"
#include "relax/barrier_view.h"

namespace amhex {

// A face of a cell: 6 * site + direction for a mutual link, or one of these.
inline constexpr int32_t kOpenFace = -1;
inline constexpr int32_t kHullFace = -2;

// A neighbour this near to where it is expected is accepted whatever lies there, in cell sizes.
inline constexpr float kSureLinkDistance = 0.55f;
// One farther than this is none; between the two, the hull takes precedence.
inline constexpr float kLargestLinkDistance = 0.75f;

// Direction of frame `q` that looks most along `wanted`.
AMHEX_HD inline int DirectionAlong(const Quatf& q, const Vec3f& wanted) {
  int best = 0;
  float best_dot = -2;
  for (int direction = 0; direction < kAxisDirectionCount; ++direction) {
    const float dot = Dot(DirectionOf(q, direction), wanted);
    if (dot > best_dot) {
      best = direction;
      best_dot = dot;
    }
  }
  return best;
}

// deviates: eq. 3 averages over all six neighbours of N_6, mutual or not; non-mutual ones drift
// and kill cells. Here only faces that choose each other count.
struct LinkBody {
  BarrierView barrier;
  ArrayView<const Vec3d> position;           // [site_count] domain frame
  ArrayView<const Quatf> orientation;        // [site_count]
  ArrayView<const Vec3f> size;               // [site_count]
  ArrayView<const int32_t> is_inside;        // [site_count]
  ArrayView<const int32_t> axis_neighbours;  // [site_count][6] of one side only
  ArrayView<int32_t> links;                  // [site_count][6]

  AMHEX_HD void operator()(int64_t site) const {
    for (int direction = 0; direction < kAxisDirectionCount; ++direction) {
      links[site * kAxisDirectionCount + direction] = LinkOf(static_cast<int32_t>(site), direction);
    }
  }

  AMHEX_HD int32_t LinkOf(int32_t site, int direction) const {
    const int32_t candidate = CandidateOf(site, direction);
    if (candidate < 0) return candidate;
    const int back =
        DirectionAlong(orientation[candidate], -DirectionOf(orientation[site], direction));
    if (CandidateOf(candidate, back) != site) return kOpenFace;
    const int forth = DirectionAlong(orientation[site], -DirectionOf(orientation[candidate], back));
    if (forth != direction) return kOpenFace;
    return candidate * kAxisDirectionCount + back;
  }

  // The neighbour that a face chooses for itself, or what it looks at instead.
  AMHEX_HD int32_t CandidateOf(int32_t site, int direction) const {
    const float reach = size[site][direction / 2];
    const Vec3d target =
        position[site] + ToDouble(DirectionOf(orientation[site], direction) * reach);
    const int32_t neighbour =
        axis_neighbours[static_cast<int64_t>(site) * kAxisDirectionCount + direction];
    float squared = 0;
    if (neighbour != kNoNode) {
      const Vec3f gap = ToFloat(position[neighbour] - target);
      squared = Dot(gap, gap) / (reach * reach);
      if (squared <= kSureLinkDistance * kSureLinkDistance) return neighbour;
    }
    const bool is_beyond_hull = barrier.IsInside(target) != (is_inside[site] != 0);
    if (is_beyond_hull) return kHullFace;
    if (neighbour != kNoNode && squared <= kLargestLinkDistance * kLargestLinkDistance) {
      return neighbour;
    }
    return kOpenFace;
  }
};

}  // namespace amhex
