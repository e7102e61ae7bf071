// Loops of five edges that no other edge interconnects: the mark of a spiral. Section 5.2, I.
//
// No triangle or quad fits into such a loop, so no primitive can use its edges. Its five inner
// edges are added; they become part of the mesh only as part of a fitting primitive.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "topology/edge_network.h"
#include "topology/loop_search.h"

namespace amhex {

// Appends every penta-loop once, ascending by its first vertex.
absl::Status FindPentaLoops(const EdgeNetwork& network, const RunContext& context,
                            std::vector<PentaLoop>* loops);

}  // namespace amhex
