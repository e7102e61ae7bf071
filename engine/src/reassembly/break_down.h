// A volume mesh taken apart: cells of Figure 2 stay as they are, all others fall into pieces.
// Section 6.2, Figures 15 and 20.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/run_context.h"
#include "output/boundary_overlap.h"
#include "topology/primitives.h"

namespace amhex {

struct BrokenVolume {
  std::vector<Vec3d> vertices;     // the input's, then the centres of broken cells
  std::vector<CellCorners> cells;  // lawful cells of Figure 2, outward
  std::vector<CellFace> boundary;  // triangles and quads that bound the solid, outward
  int64_t broken_count = 0;        // cells that became pieces around their centre
  int64_t hollow_count = 0;        // cells not even pieces could be made of; left to closure
};

// Cells are turned outward where they are inverted. A cell that is none of Figure 2, or not lawful
// as it stands, becomes one pyramid or tetrahedron per face around the average of its vertices;
// larger polygons are cut into triangles from their smallest vertex, the same way from both sides.
// Where a quadrangle lies against two triangles nothing bounds the solid; that slit is closure's.
//
// INVALID_ARGUMENT (first offender and count) for cells whose faces do not close, and for faces
// that two cells claim from the same side. `mesh` must have passed CheckInput. O(n log n).
//
// Every lawful cell is kept, also where the solid's own boundary folds back over the solid or two
// of its parts overlap: each cell is as the user made it, and taking some away would not say which
// is the wrong one.
absl::StatusOr<BrokenVolume> BreakDown(const VolumeMesh& mesh, const RunContext& run);

// Places that the cells cover twice as they were given; none if anything else is wrong with them.
OverlapReport OwnOverlap(const BrokenVolume& volume);

// The boundary as triangles over the same vertices; unused ones are left out.
TriangleMesh BoundaryOf(const BrokenVolume& volume);

}  // namespace amhex
