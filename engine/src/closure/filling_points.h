// New vertices where a cavity has too few to be filled well.
#pragma once

#include <vector>

#include "closure/cavities.h"
#include "closure/fill_scope.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

// Adds vertices near the scope's cavities: corners and sharp edges of the hull first, then its
// faces, then the inside; all about an edge length from each other and from the cells that remain.
// Returns their ids. O(cavity size).
std::vector<int> AddFillingPoints(const Hull& hull, const Cavities& cavities,
                                  const FillScope& scope, WorkingMesh* mesh);

}  // namespace amhex
