#include "input/wanted_cells.h"

#include "input/single_layers.h"

namespace amhex {

double WantedCells(const Hull& hull, const StopPoll& poll) {
  const SurfaceOfSolid surface{hull.vertices, hull.triangles, hull.volume};
  return hull.volume + FindSingleLayers(surface, *hull.queries, 1, poll).ExcessCells(1);
}

}  // namespace amhex
