// Missing layers at the hull: open faces that look at it from up to a cell away grow a cell there.
#pragma once

#include "closure/cavities.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

// Extrudes open faces to the hull, cavity by cavity, where that leaves fewer faces open: a quad
// becomes a hexahedron (or a hexprism, prism or slice where corners lie on the hull already), a
// triangle a prism. Neighbouring columns share their sides. Returns the number of new cells.
int ExtrudeToHull(const Hull& hull, WorkingMesh* mesh);

}  // namespace amhex
