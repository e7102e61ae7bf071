#include "topology/penta_loops.h"

#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

constexpr int64_t kVerticesPerBlock = 256;

// Completes the path b a e to rings a b c d e.
void CompleteLoops(const EdgeNetwork& network, int32_t b, int32_t a, int32_t e,
                   std::vector<PentaLoop>* loops) {
  for (const int32_t c : network.neighbours(b)) {
    if (c <= a || c == e || network.AreConnected(c, a) || network.AreConnected(c, e)) continue;
    for (const int32_t d : CommonNeighbours(network, c, e)) {
      if (d <= a || d == b || network.AreConnected(d, a) || network.AreConnected(d, b)) continue;
      loops->push_back({a, b, c, d, e});
    }
  }
}

void FindLoopsAt(const EdgeNetwork& network, int32_t a, std::vector<PentaLoop>* loops) {
  const auto around = network.neighbours(a);
  for (size_t i = 0; i < around.size(); ++i) {
    if (around[i] < a) continue;
    for (size_t j = i + 1; j < around.size(); ++j) {
      if (network.AreConnected(around[i], around[j])) continue;
      CompleteLoops(network, around[i], a, around[j], loops);
    }
  }
}

}  // namespace

absl::Status FindPentaLoops(const EdgeNetwork& network, const RunContext& context,
                            std::vector<PentaLoop>* loops) {
  return CollectFromBlocks(network.vertex_count(), kVerticesPerBlock, context, loops,
                           [&](int64_t begin, int64_t end, std::vector<PentaLoop>* found) {
                             for (int64_t a = begin; a < end; ++a) {
                               FindLoopsAt(network, static_cast<int32_t>(a), found);
                             }
                           });
}

std::array<VertexPair, 5> InteriorEdges(const PentaLoop& loop) {
  std::array<VertexPair, 5> edges;
  for (int i = 0; i < 5; ++i) edges[i] = {loop[i], loop[(i + 2) % 5]};
  return edges;
}

}  // namespace amhex
