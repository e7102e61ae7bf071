// The last resort of the closure: what stars cannot fill becomes tetrahedra of the Delaunay
// complex of all vertices.
//
// A cell that is an exact union of Delaunay tetrahedra cannot overlap any other one, and between
// such cells the complex says exactly what is left. So the void around a cavity, and the cells in
// it that are no such unions, are replaced by the tetrahedra that lie there.
#pragma once

#include <cstdint>

#include "closure/cavities.h"
#include "closure/fill_scope.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

// Fills the scope's cavities, and others that they turn out to be connected with. Quads of
// remaining cells that now face two triangles stay open (three-face slits, which stars close).
// `seed` varies the choice among equal complexes. False, and no cell changed, if a local filling
// would reach the border of its scope. O(n log n) in the number of the scope's vertices.
bool FillByDelaunay(const Hull& hull, const Cavities& cavities, const FillScope& scope,
                    uint64_t seed, WorkingMesh* mesh);

}  // namespace amhex
