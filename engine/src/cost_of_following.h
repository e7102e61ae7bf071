// What drawing the boundary of a placed candidate to the hull is likely to cost, learnt from those
// that were.
#pragma once

#include <algorithm>
#include <limits>

#include "placed_loss.h"

namespace amhex {

// Of what a boundary is too far from the hull, drawing it there mends little or most: nothing to a
// quarter on bunny and igea with noise, all on fandisk and rocker-arm.
inline constexpr double kMendedShare = 0.5;

// As a share of what the boundary was too far away: negative where following mends more of that
// than it takes from the cells. Expected to mend kMendedShare until one was followed, then as it
// was with the one that gained most, if that is less: on a gear the cells lost two to twelve
// times what the distance gained, with each of nine lattices.
class CostOfFollowing {
 public:
  // The total of a candidate that is not followed yet, once it is.
  double LikelyTotal(const PlacedLoss& loss) const { return loss.total() + share_ * loss.distance; }

  // Of a candidate that was.
  void Learn(const PlacedLoss& before, const PlacedLoss& after) {
    if (before.distance == 0) return;
    least_ = std::min(least_, (after.total() - before.total()) / before.distance);
    share_ = std::max(-kMendedShare, least_);
  }

 private:
  double least_ = std::numeric_limits<double>::infinity();
  double share_ = -kMendedShare;
};

}  // namespace amhex
