// The sites that may own a point of one lattice tile, and the arithmetic over all of them at once.
//
// Arrays instead of structs, and loops over whole groups of a fixed number of candidates, so that
// the host compiler turns them into vector instructions.
#pragma once

#include <cstdint>

#include "base/platform.h"
#include "relax/fcc_lattice.h"
#include "relax/site_metric.h"

namespace amhex {

// More than a tile of the coarsest lattice (8 points per site) meets; tiles with more fall back
// to looking at every near site for every point.
inline constexpr int kCandidateCapacity = 256;
// One AVX-512 register of floats.
inline constexpr int kCandidateGroup = 16;
// Added to culling bounds, edge lengths: far above the rounding of float coordinates.
inline constexpr float kCullSlack = 1e-3f;
// Where the candidates that fill up the last group lie: farther than any real one.
inline constexpr float kFarAway = 1e9f;

struct LabelCandidates {
  int count = 0;
  int padded_count = 0;  // next multiple of the group
  int32_t id[kCandidateCapacity];
  int32_t slot[kCandidateCapacity];  // of `metric`
  float x[kCandidateCapacity], y[kCandidateCapacity], z[kCandidateCapacity];
  float row[9][kCandidateCapacity];
  float reach[3][kCandidateCapacity];

  // Fills the arrays from the slots.
  AMHEX_HD void Load(const SiteMetric* metric) {
    for (int k = 0; k < count; ++k) {
      const SiteMetric& site = metric[slot[k]];
      x[k] = site.x;
      y[k] = site.y;
      z[k] = site.z;
      for (int i = 0; i < 9; ++i) row[i][k] = site.row[i];
      for (int i = 0; i < 3; ++i) reach[i][k] = site.reach[i];
    }
    padded_count = (count + kCandidateGroup - 1) / kCandidateGroup * kCandidateGroup;
    for (int k = count; k < padded_count; ++k) {
      x[k] = y[k] = z[k] = kFarAway;
      for (int i = 0; i < 9; ++i) row[i][k] = i % 4 == 0 ? 1.0f : 0.0f;
      for (int i = 0; i < 3; ++i) reach[i][k] = 1.0f;
    }
  }

  AMHEX_HD SiteMetric At(int k) const {
    SiteMetric site;
    site.x = x[k];
    site.y = y[k];
    site.z = z[k];
    for (int i = 0; i < 9; ++i) site.row[i] = row[i][k];
    for (int i = 0; i < 3; ++i) site.reach[i] = reach[i][k];
    return site;
  }

  // Ascending ids, so that the first of equal distances has the smallest one.
  AMHEX_HD void SortById() {
    for (int k = 1; k < count; ++k) {
      const int32_t moved_id = id[k];
      const int32_t moved_slot = slot[k];
      int at = k;
      for (; at > 0 && id[at - 1] > moved_id; --at) {
        id[at] = id[at - 1];
        slot[at] = slot[at - 1];
      }
      id[at] = moved_id;
      slot[at] = moved_slot;
    }
  }
};

// The smallest upper bound of all candidates over a cube: no point in it is farther from its owner.
AMHEX_HD inline float SmallestUpperBound(const LabelCandidates& candidates, const Vec3f& centre,
                                         float half_width) {
  float smallest[kCandidateGroup];
  for (int i = 0; i < kCandidateGroup; ++i) smallest[i] = kUnboundedReach;
  for (int k = 0; k < candidates.padded_count; k += kCandidateGroup) {
    for (int i = 0; i < kCandidateGroup; ++i) {
      const float upper = BoundsOverCube(candidates.At(k + i), centre, half_width).upper;
      smallest[i] = Smaller(smallest[i], upper);
    }
  }
  float result = kUnboundedReach;
  for (int i = 0; i < kCandidateGroup; ++i) result = Smaller(result, smallest[i]);
  return result;
}

// Lists in `chosen` the candidates whose lower bound over a cube does not exceed `limit`.
AMHEX_HD inline int ChooseCandidates(const LabelCandidates& candidates, const Vec3f& centre,
                                     float half_width, float limit, int32_t* chosen) {
  int count = 0;
  for (int k = 0; k < candidates.padded_count; k += kCandidateGroup) {
    float lower[kCandidateGroup];
    for (int i = 0; i < kCandidateGroup; ++i) {
      lower[i] = BoundsOverCube(candidates.At(k + i), centre, half_width).lower;
    }
    for (int i = 0; i < kCandidateGroup; ++i) {
      chosen[count] = k + i;
      count += lower[i] <= limit ? 1 : 0;
    }
  }
  return count;
}

// For the 32 points of the block around `centre`: owned[i] gets the mask of the points nearer to
// candidate chosen[i] than to any other chosen one, and nearer than `limit`.
AMHEX_HD inline void OwnPoints(const LabelCandidates& candidates, const int32_t* chosen,
                               int chosen_count, const Vec3f& centre, float limit,
                               uint32_t* owned) {
  float x[kBlockPoints], y[kBlockPoints], z[kBlockPoints];
  float nearest[kBlockPoints];
  int32_t owner[kBlockPoints];
  uint32_t bit[kBlockPoints];
  for (int p = 0; p < kBlockPoints; ++p) {
    const Vec3f step = StepFromCentre(p);
    x[p] = step.x;
    y[p] = step.y;
    z[p] = step.z;
    nearest[p] = limit;
    owner[p] = -1;
    bit[p] = 1u << p;
  }
  for (int i = 0; i < chosen_count; ++i) {
    const SiteMetric site = candidates.At(chosen[i]);
    const MetricComponents at_centre = ComponentsAt(site, centre);
    for (int p = 0; p < kBlockPoints; ++p) {
      const float distance = DistanceBeside(at_centre, ChangeOf(site.row, {x[p], y[p], z[p]}));
      const bool is_nearer = distance < nearest[p];
      nearest[p] = is_nearer ? distance : nearest[p];
      owner[p] = is_nearer ? i : owner[p];
    }
  }
  for (int i = 0; i < chosen_count; ++i) {
    uint32_t mask = 0;
    for (int p = 0; p < kBlockPoints; ++p) mask |= bit[p] & -static_cast<uint32_t>(owner[p] == i);
    owned[i] = mask;
  }
}

}  // namespace amhex
