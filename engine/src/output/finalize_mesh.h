// From a complex under construction to the mesh a user receives.
#pragma once

#include "amhex/volume_mesh.h"
#include "assembly/cell_complex.h"
#include "base/stop_poll.h"
#include "input/hull.h"

namespace amhex {

// Vertices in the user's units, those of cells only, in their old order. Every cell is listed so
// that its corners repeat exactly as in Figure 2's list for its type, starting with the smallest
// ids that allows; cells are sorted by type (hexahedra first), then by their sorted corners. Types
// and qualities are filled. The result depends on the complex's vertex order alone, not on the
// order or turning of its cells. O(n log n). Throws RunStopped when `poll` does.
//
// Requires that every cell is recognised by RecognizeCell.
AtMostHexaMesh FinalizeMesh(const CellComplex& complex, const Frame& frame,
                            const StopPoll& poll = {});

// The turn of `corners` described above.
CellCorners CanonicalCorners(const CellCorners& any_corners);

}  // namespace amhex
