// Visits vertices that may move as their neighbours do, several at a time.
#pragma once

#include <cstdint>
#include <functional>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "optimize/vertex_neighbourhoods.h"

namespace amhex {

// Calls visit(v) for every vertex that is wanted, those that share a cell in the order of their
// colours. `visit` may move v and read the cells around it; wants(v) must not depend on it. The
// result does not depend on the thread count. Ends early with the reason when the run is to stop.
//
// Work besides the calls: a look at every vertex, and at the cells of those wanted.
absl::Status VisitByColour(const VertexNeighbourhoods& neighbourhoods, const RunContext& run,
                           const std::function<bool(int32_t)>& wants,
                           const std::function<void(int32_t)>& visit);

}  // namespace amhex
