// Visits vertices that may move as their neighbours do, several at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "optimize/vertex_neighbourhoods.h"

namespace amhex {

// What visits leave for those that follow, so that few of them cost little however many vertices
// there are; empty at first, of one mesh.
struct VisitScratch {
  std::vector<int32_t> visitor_of_cell;  // -1 between visits
};

// Calls visit(v) for every vertex that is wanted, those that share a cell in the order of their
// colours. `among`: vertices, ascending, no others are wanted; wants(v) must not depend on visits.
// `visit` may move v and read the cells around it. The result does not depend on the thread count.
// Ends early with the reason when the run is to stop.
//
// Work besides the calls: a look at every vertex of `among`, and at the cells of those wanted.
absl::Status VisitByColour(const VertexNeighbourhoods& neighbourhoods,
                           const std::vector<int32_t>& among, const RunContext& run,
                           const std::function<bool(int32_t)>& wants,
                           const std::function<void(int32_t)>& visit, VisitScratch& scratch);

}  // namespace amhex
