// Points where a solid tapers off so slowly that hexahedra have no room long before it ends.
#pragma once

#include <vector>

#include "base/stop_poll.h"
#include "input/hull.h"

namespace amhex {

// The apex of a cone of less than 50 degrees, as an acute ridge's sides have
// (input/sharp_features), whatever its section.
struct AcuteTip {
  Vec3d apex;
  Vec3d outward;  // unit, from the solid through the apex
  // Cells end so far before the apex, edge lengths: the nearer, the shorter their last edges.
  double blunted = 0;
  // The solid is less than an edge length wide up to so far from the apex, [3, 30].
  double narrow = 0;
};

// In the order of the hull's vertices, which apexes are. Pits are none, nor are peaks of noise:
// three edge lengths from the apex the solid still has to be as narrow as such a cone. O(n) but for
// questions about the few vertices that may be one. Throws RunStopped when `poll` does.
std::vector<AcuteTip> AcuteTips(const Hull& hull, const StopPoll& poll = {});

}  // namespace amhex
