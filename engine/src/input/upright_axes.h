// The axes along which the flat parts of a surface look.
#pragma once

#include "amhex/input_hull.h"
#include "base/axis_frame.h"
#include "base/stop_poll.h"

namespace amhex {

struct UprightAxes {
  AxisFrame
      axes;  // right-handed, named so that they are turned from the world's as little as can be
  // Share of the surface's area whose normal is along one of the axes, or of the world's; what is
  // off by a degree or two counts in part. [0, 1]
  double share_along = 0;
  double share_along_world = 0;
};

// Among the axes that normals of much area suggest those with the largest share; the world's where
// none has more. Linear in the triangles. Throws RunStopped when `poll` does.
UprightAxes FindUprightAxes(const TriangleMesh& surface, const StopPoll& poll = {});

}  // namespace amhex
