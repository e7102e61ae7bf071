// The ways to cut a polygon of the hull into faces of cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "topology/primitives.h"

namespace amhex {

// Every way to cut the polygon into quadrilaterals and at most so many triangles along diagonals,
// with no new vertex; faces in the polygon's orientation. Without a limit 3 of a quadrilateral, 10
// of a pentagon, 38 of a hexagon; quadrilaterals alone 12 of an octagon.
std::vector<std::vector<CellFace>> CutPolygon(const std::vector<int32_t>& polygon,
                                              size_t most_triangles);

}  // namespace amhex
