// A volume mesh taken apart: cells of Figure 2 stay as they are, all others fall into pieces.
// Section 6.2, Figures 15 and 20.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/run_context.h"
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
// A lawful cell can still fold a face, which only matters where another part of the mesh lies
// behind it. Cells with three vertices flagged in `may_not_fold` ([vertex_count], or empty for
// none) must not.
absl::StatusOr<BrokenVolume> BreakDown(const VolumeMesh& mesh,
                                       const std::vector<uint8_t>& may_not_fold,
                                       const RunContext& run);

// The same with as few cells broken as the law permits the whole mesh: first none for a fold, then
// those at the hull, then all.
absl::StatusOr<BrokenVolume> BreakDownToLaw(const VolumeMesh& mesh, const RunContext& run);

// The boundary as triangles over the same vertices; unused ones are left out.
TriangleMesh BoundaryOf(const BrokenVolume& volume);

}  // namespace amhex
