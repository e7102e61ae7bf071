// Second fundamental forms of the hull's triangles. Paper: 4.3, after Rusinkiewicz 2004.
#pragma once

#include <vector>

#include "amhex/vec3.h"
#include "base/stop_poll.h"
#include "input/hull.h"
#include "input/surface_tensor.h"

namespace amhex {

// [triangle_count] how the normal turns along the triangle: Between(d, d) is the curvature in the
// unit direction d, in 1 / edge length, positive where the solid is convex. Corner normals are
// taken over the triangles that are reached without crossing a sharp edge.
std::vector<SymmetricTensor> TriangleCurvatures(const Hull& hull, const StopPoll& poll = {});

}  // namespace amhex
