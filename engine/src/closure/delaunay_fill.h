// The last resort of the closure: what stars cannot fill becomes tetrahedra of the Delaunay
// complex of all vertices.
//
// A cell that is an exact union of Delaunay tetrahedra cannot overlap any other one, and between
// such cells the complex says exactly what is left. So the void around a cavity, and the cells in
// it that are no such unions, are replaced by the tetrahedra that lie there.
#pragma once

#include <cstdint>

#include "closure/cavities.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

struct DelaunayFillReport {
  int cells_removed = 0;
  int hexahedra_removed = 0;
  int tetrahedra_added = 0;
  int pyramids_added = 0;
};

// Fills every cavity of `mesh`. Quads of remaining cells that now face two triangles stay open
// (three-face slits, which stars close). `seed` varies the choice among equal complexes.
// O(n log n) in the number of vertices.
DelaunayFillReport FillByDelaunay(const Hull& hull, const Cavities& cavities, uint64_t seed,
                                  WorkingMesh* mesh);

}  // namespace amhex
