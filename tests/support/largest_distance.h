// How far a mesh's boundary and a hull are from each other.
#pragma once

#include <algorithm>

#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "output/mesh_statistics.h"
#include "support/grid_complex.h"

namespace amhex::testing_support {

// Either way, edge lengths, as statistics have it.
inline double LargestDistance(const CellComplex& complex, const Hull& hull) {
  const MeshStatistics statistics = MeasureMesh(MeshOf(complex), hull);
  return std::max(statistics.mesh_to_input_max, statistics.input_to_mesh_max) * hull.box.Diagonal();
}

}  // namespace amhex::testing_support
