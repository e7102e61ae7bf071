// Sweeps after vertices of the boundary have been moved towards the hull, which costs the cells
// around them.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "optimize/placement.h"

namespace amhex {

// [vertex] 1: on the boundary.
std::vector<uint8_t> BoundaryVertices(const Placement& placement);

// Raises the average around vertices that have moved, and places that are poor then. What `stays`
// marks does; no cell that is better falls below `floor`. CANCELLED, DEADLINE_EXCEEDED.
absl::Status RegainQuality(Placement& placement, const std::vector<uint8_t>& moved,
                           const std::vector<uint8_t>& stays, double floor, const RunContext& run);

}  // namespace amhex
