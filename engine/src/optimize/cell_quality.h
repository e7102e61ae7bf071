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

#include <array>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "optimize/cell_pattern.h"

namespace amhex {

// Minimum scaled Jacobian of a valid cell, in (0, 1]; a value <= 0 that grows towards 0 as the
// worst violation shrinks for an invalid one; -1 for no cell of Figure 2 or non-finite corners.
// Some 200 ns, no allocation; safe from any thread.
double CellQuality(const CellCorners& corners, const std::vector<Vec3d>& vertices);

// The two halves of CellQuality for a pattern that is known already, positions given by slot.
//
// Scaled Jacobians of pattern.corner[0 .. corner_count), NaN where corners are not finite.
using CornerJacobians = std::array<double, 8>;
void ScaledJacobians(const CellPattern& pattern, const std::array<Vec3d, 8>& positions,
                     CornerJacobians& jacobians);
// The least Gauss point or face triangle determinant in units of the mean edge length cubed, less
// a margin: positive where the cell does not fold.
double FoldMargin(const CellPattern& pattern, const std::array<Vec3d, 8>& positions);

}  // namespace amhex
