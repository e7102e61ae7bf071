#include "geometry/close_cuts.h"

#include <algorithm>
#include <tuple>
#include <vector>

#include "base/sort_polling.h"
#include "base/status_macros.h"
#include "geometry/cut_search.h"
#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

// Per block of the parallel loops: some ten microseconds, and more where there are cuts.
constexpr int64_t kCubesPerBlock = 256;
constexpr int64_t kEdgesPerBlock = 1024;

absl::StatusOr<std::vector<OpenEdge>> CollectOpenEdges(const MergeView& sets,
                                                       const RunContext& run) {
  std::vector<OpenEdge> edges;
  AMHEX_RETURN_IF_ERROR(
      CollectItems(sets.cubes.centre.size, kCubesPerBlock, run, OpenEdgeSearch{sets}, &edges));
  ParallelSortPolling(edges.begin(), edges.end(), StopPoll(run),
                      [](const OpenEdge& a, const OpenEdge& b) {
                        return std::tuple(a.low, a.high, a.cube, a.direction, a.corner) <
                               std::tuple(b.low, b.high, b.cube, b.direction, b.corner);
                      });
  return edges;
}

absl::StatusOr<std::vector<FacePair>> CollectCuts(const CutSearch& search, const RunContext& run) {
  std::vector<FacePair> cuts;
  AMHEX_RETURN_IF_ERROR(CollectItems(search.edges.size, kEdgesPerBlock, run, search, &cuts));
  std::stable_sort(cuts.begin(), cuts.end(),
                   [](const FacePair& a, const FacePair& b) { return a.score < b.score; });
  return cuts;
}

}  // namespace

absl::StatusOr<int> CloseCuts(const CutRules& rules, const RunContext& run, const MergeView& sets) {
  int total = 0;
  for (int round = 0; round < kMaxCutRounds; ++round) {
    AMHEX_ASSIGN_OR_RETURN(const std::vector<OpenEdge> edges, CollectOpenEdges(sets, run));
    const CutSearch search{
        sets.cubes, {edges.data(), static_cast<int64_t>(edges.size())}, rules.max_gap};
    AMHEX_ASSIGN_OR_RETURN(const std::vector<FacePair> cuts, CollectCuts(search, run));
    int merged = 0;
    for (const FacePair& cut : cuts) merged += sets.TryGlue(cut, rules.collapse) ? 1 : 0;
    total += merged;
    if (merged == 0) break;
  }
  return total;
}

}  // namespace amhex
