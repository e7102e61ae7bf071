// A part of the mesh that is about to be filled anew: cavities plus the cells absorbed into them.
#pragma once

#include <vector>

#include "closure/cavities.h"
#include "closure/star_geometry.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

struct Region {
  std::vector<int> cells;            // absorbed, ascending
  std::vector<int> cavities;         // ascending
  std::vector<CellFace> walls;       // faces of remaining cells, looking into the region
  std::vector<CellFace> hull_faces;  // former hull faces of absorbed cells, looking in
  KernelPoint kernel;
};

// Recomputes walls and hull faces; cavities that touch an absorbed cell join the region. False if
// the region grows beyond `max_walls` or meets a face that opened after the cavities were
// collected.
bool UpdateRegion(const WorkingMesh& mesh, const Cavities& cavities, size_t max_walls,
                  Region* region);

// Sets the kernel of the walls and of the hull's tangent planes at the loops' vertices; `hopeless`
// as of FindKernel.
void UpdateKernel(const WorkingMesh& mesh, const Hull& hull, double hopeless, Region* region);

// Living cells behind the walls, ascending, without those already absorbed.
std::vector<int> CellsAround(const WorkingMesh& mesh, const Region& region);

}  // namespace amhex
