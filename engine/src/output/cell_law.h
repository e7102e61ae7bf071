// What one cell must be, derived from Figure 2's 8-corner lists and the trilinear map alone.
//
// Written apart from topology/ and optimize/ on purpose: the validator must not inherit a mistake
// of the code that builds cells.
#pragma once

#include <optional>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "output/measure_cell.h"

namespace amhex {

// The type of a cell whose equal corners are those of a pattern of Figure 2, up to the 48
// symmetries of the cube; nullopt for every other way to repeat corners.
std::optional<PrimitiveType> TypeByPattern(const CellCorners& corners);

// As measure_cell.h has it.
CellMeasures MeasureCell(const CellCorners& corners, const std::vector<Vec3d>& vertices);

}  // namespace amhex
