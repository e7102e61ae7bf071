// Places where a closed complex still breaks the law of an embedded boundary.
#pragma once

#include <functional>
#include <vector>

#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

// Boundary faces that may lie far from the hull.
using MayBeFar = std::function<bool(const CellFace& face)>;

// Vertices of boundary edges with more than two boundary faces, of boundary vertices where sheets
// touch, of boundary faces that face each other across a slit, that lie far from the hull, unless
// `may_be_far` says they may, or dip into another part of the mesh; ascending, empty if all is
// well. O(n log n). Throws RunStopped when `poll` does.
std::vector<int32_t> FindBoundaryDefects(const WorkingMesh& mesh, const Hull& hull,
                                         const StopPoll& poll = {},
                                         const MayBeFar& may_be_far = {});

}  // namespace amhex
