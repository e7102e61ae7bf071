// Connected parts of a cavity's open faces.
#pragma once

#include <vector>

#include "closure/working_mesh.h"

namespace amhex {

// Faces that share an edge, within one cavity.
std::vector<std::vector<int>> FaceNeighbours(const std::vector<CellFace>& faces);

// The faces connected to `seed` within `radius` of it, ascending.
std::vector<int> PartAround(const std::vector<CellFace>& faces, const std::vector<Vec3d>& centres,
                            const std::vector<std::vector<int>>& neighbours, int seed,
                            double radius);

}  // namespace amhex
