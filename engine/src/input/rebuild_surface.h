// Surfaces made anew where an input cannot be kept as it is: clouds and broken meshes.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/run_context.h"
#include "input/close_mesh.h"

namespace amhex {

// Both return a closed two-manifold around the places whose winding number exceeds one half, in
// grid cells of at most h / 2.5, h the wanted edge length (for a cell count: from the volume as
// counted on a coarse grid; without any wish as for 5000 cells), which is returned too; pieces
// that could not hold half a cell are left out. Inputs are in a frame whose box diagonal is
// about 1. INVALID_ARGUMENT if nothing is enclosed.

// Appendix B: the cloud's samples, smooth between them.
absl::StatusOr<ClosedSurface> RebuildFromCloud(const PointCloud& cloud, const WantedSize& wanted,
                                               RunContext& run);

// Any soup; triangles are taken to be oriented as far as they can be. INVALID_ARGUMENT, before it
// is tried, also where its triangles are so many and reach so far across each other that the
// winding numbers for the cells wanted would take minutes.
absl::StatusOr<ClosedSurface> RebuildFromSoup(const TriangleMesh& soup, const WantedSize& wanted,
                                              RunContext& run);

}  // namespace amhex
