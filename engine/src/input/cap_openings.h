// Fills the openings of a manifold surface with triangles between their own vertices.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "amhex/input_hull.h"
#include "amhex/run_context.h"

namespace amhex {

// Appends to `mesh` one patch per loop (vertex ids in the patch's direction, as FindOpenings gives
// them). Loops of up to 256 vertices get the patch of least area among all triangulations, by
// dynamic programming (Barequet and Sharir 1995), O(n^3); longer ones are first cut along short
// chords, O(n^2). Edges that the surface already has are avoided, so that the result stays
// manifold.
absl::Status CapOpenings(const std::vector<std::vector<int32_t>>& loops, RunContext& run,
                         TriangleMesh& mesh);

}  // namespace amhex
