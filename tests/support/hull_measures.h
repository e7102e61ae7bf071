// What tests measure on a hull as its user would.
#pragma once

#include <cmath>

#include "amhex/input_hull.h"
#include "input/hull.h"

namespace amhex::testing_support {

// In normalised coordinates.
inline TriangleMesh SurfaceOf(const Hull& hull) { return {hull.vertices, hull.triangles}; }

// Enclosed by the hull, in the input's units.
inline double UserVolume(const Hull& hull) { return hull.volume * std::pow(hull.frame.scale, 3); }

}  // namespace amhex::testing_support
