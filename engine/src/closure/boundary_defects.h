// Places where a closed complex still breaks the law of an embedded boundary.
#pragma once

#include <cstdint>
#include <vector>

#include "assembly/cell_complex.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

struct BoundaryDefects {
  // Of boundary edges with more than two boundary faces, of boundary vertices where sheets touch,
  // of boundary faces that face each other across a slit, that lie far from the hull or dip into
  // another part of the mesh; ascending, empty if all is well. Quads that meet along two edges and
  // leave some room between them bound a notch, which the solid may have.
  std::vector<int32_t> vertices;
  // The boundary would be lawful, were it not far from the hull somewhere.
  bool are_just_far = false;
};

// O(n log n). Throws RunStopped when `poll` does.
BoundaryDefects FindBoundaryDefects(const WorkingMesh& mesh, const Hull& hull,
                                    const StopPoll& poll = {});

// Vertices at defects of `after` that are at none of `before`, whose vertices it has kept.
std::vector<int32_t> NewBoundaryDefects(const WorkingMesh& before, const WorkingMesh& after,
                                        const Hull& hull, const StopPoll& poll = {});

// Those at faces near these vertices of the complex, within a few edge lengths: what moving them
// can have done. Cells are not looked at, and nothing else of the boundary but what lies there.
BoundaryDefects FindBoundaryDefectsNear(const std::vector<int32_t>& vertices,
                                        const CellComplex& complex, const Hull& hull,
                                        const StopPoll& poll = {});

}  // namespace amhex
