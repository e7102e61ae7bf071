// Loops of five edges that no other edge interconnects: the mark of a spiral. Section 5.2, I.
//
// No triangle or quad fits into such a loop, so no primitive can use its edges. Its five inner
// edges are added; they become part of the mesh only as part of a fitting primitive.
#pragma once

#include <array>
#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "topology/edge_network.h"

namespace amhex {

// The ring's vertices, smallest first, the smaller neighbour of it second.
using PentaLoop = std::array<int32_t, 5>;

// Appends every penta-loop once, ascending by its first vertex.
absl::Status FindPentaLoops(const EdgeNetwork& network, const RunContext& context,
                            std::vector<PentaLoop>* loops);

// The five edges across a loop.
std::array<VertexPair, 5> InteriorEdges(const PentaLoop& loop);

}  // namespace amhex
