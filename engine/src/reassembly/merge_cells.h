// Puts a volume mesh together anew: as many hexahedra, as few cells as its vertices allow.
// Section 5.2, III, for a volume that is full of cells already.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "reassembly/merge_candidates.h"

namespace amhex {

// Starts from the atoms and exchanges a few of the mesh's pieces at a time for others that fill the
// same place, as long as that gains: hexahedra first, fewer cells second. A merged quad must meet
// the same quad, or the hull, so what an exchange breaks around it is part of the exchange; the
// mesh is as conforming after each of them as the input was.
//
// Returns the chosen pieces, ascending. Deterministic. Every exchange is searched within a bounded
// neighbourhood, so the time is linear in the pieces.
absl::StatusOr<std::vector<int32_t>> MergeCells(const PieceTable& table, RunContext& run);

}  // namespace amhex
