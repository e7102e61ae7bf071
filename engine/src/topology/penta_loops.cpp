#include "topology/penta_loops.h"

#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

constexpr int64_t kPentaLoopStartsPerBlock = 256;

}  // namespace

absl::Status FindPentaLoops(const EdgeNetwork& network, const RunContext& context,
                            std::vector<PentaLoop>* loops) {
  return CollectItems(network.vertex_count(), kPentaLoopStartsPerBlock, context,
                      PentaLoopSearch{network.view()}, loops);
}

}  // namespace amhex
