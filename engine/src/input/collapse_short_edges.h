// Takes slivers out of a closed surface without changing its shape or topology.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/input_hull.h"
#include "base/stop_poll.h"

namespace amhex {

// Collapses edges shorter than `shortest`, shortest first. The merged vertex lies at the end with
// the higher `rank` (2 on sharp edges, 3 at corners), between both if they are equal, and keeps it.
// An edge stays if its collapse would change the topology (link condition, Dey et al. 1999) or turn
// a triangle over. Unused vertices are dropped from `mesh` and `rank`. Returns the number of
// collapses.
int64_t CollapseShortEdges(double shortest, TriangleMesh& mesh, std::vector<uint8_t>& rank);

// The same for none but these edges, each given once.
using MeshEdge = std::array<int32_t, 2>;  // vertices
int64_t CollapseShortEdges(double shortest, const std::vector<MeshEdge>& edges, TriangleMesh& mesh,
                           std::vector<uint8_t>& rank, const StopPoll& poll = {});

}  // namespace amhex
