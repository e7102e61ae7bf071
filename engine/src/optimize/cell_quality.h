// One number per cell: is it valid in every sense the output is judged by, and how good is it.
//
// Valid means all of
//   - a pattern of Figure 2,
//   - a positive scaled Jacobian wherever three edges meet (section 5.2); at a pyramid's base this
//     is the positivity of the four apex tetrahedra,
//   - a positive Jacobian of the trilinear map at its 2x2x2 Gauss points (the corners that are not
//     collapsed are among those of the line above),
//   - for all types but the slice: every face triangle, with either diagonal of a quad, is seen
//     from the inside of the vertex average. (A slice's two quads share two edges and cannot both
//     turn their folded triangle to the same side.)
#pragma once

#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "optimize/cell_measures.h"
#include "optimize/cell_pattern.h"

namespace amhex {

// Minimum scaled Jacobian of a valid cell, in (0, 1]; a value <= 0 that grows towards 0 as the
// worst violation shrinks for an invalid one; -1 for no cell of Figure 2 or non-finite corners.
// Some 200 ns, no allocation; safe from any thread. Its two halves: cell_measures.h.
double CellQuality(const CellCorners& corners, const std::vector<Vec3d>& vertices);

}  // namespace amhex
