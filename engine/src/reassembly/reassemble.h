// From a volume mesh to a complex of at-most-hexa cells over its own vertices. Section 6.2: “we
// simply skip the relaxation part [...] and directly break down the input structure, and then
// reassemble the final elements as usual”.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "reassembly/break_down.h"
#include "reassembly/merge_candidates.h"

namespace amhex {

// The hull of the broken volume, edge length 1 being the mean length of its cells' edges; what was
// broken is told in the warnings. INVALID_ARGUMENT if its boundary does not bound a solid.
absl::StatusOr<Hull> BuildHullOfVolume(const BrokenVolume& volume, const MeshingParams& params,
                                       RunContext& run);

// The faces of the chosen pieces that lie on the hull, in their order.
void AppendHullFaces(const PieceTable& table, const std::vector<int32_t>& chosen,
                     std::vector<CellFace>* faces);

// The chosen pieces, vertices in the hull's frame. Slits and cells that could not be broken down
// are left open.
CellComplex ComplexOfPieces(const BrokenVolume& volume, const PieceTable& table,
                            const std::vector<int32_t>& chosen, const Frame& frame);

// True if some face of a cell is neither matched nor part of the hull.
bool HasOpenFaces(const CellComplex& complex);

// The finished mesh in the user's frame; vertices that did not move get back the input's own bits.
AtMostHexaMesh FinalizeReassembled(const CellComplex& complex, const BrokenVolume& volume,
                                   const Frame& frame);

}  // namespace amhex
