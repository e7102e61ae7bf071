// A finer mesh over a volume mesh: a hexahedron around every corner of every cell.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "reassembly/break_down.h"

namespace amhex {

// New vertices halve the edges and lie at the average of the corners of faces and cells; the
// volume's own keep their numbers. A corner where three edges of a cell meet gets a hexahedron from
// the corner to the cell's centre; where more meet, as at a pyramid's apex, pyramids around the
// average of that place. Neighbours cut a common face the same way, so the result conforms where
// the volume does. Places that would not be lawful cells stay open. Vertices are in `frame`.
// O(n log n).
absl::StatusOr<CellComplex> SubdivideCells(const BrokenVolume& volume, const Frame& frame,
                                           const RunContext& run);

}  // namespace amhex
