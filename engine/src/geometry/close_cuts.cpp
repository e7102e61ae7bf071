#include "geometry/close_cuts.h"

#include <algorithm>
#include <tuple>
#include <vector>

#include "base/sort_polling.h"
#include "geometry/cut_search.h"

namespace amhex {
namespace {

std::vector<OpenEdge> CollectOpenEdges(const MergeView& sets, const StopPoll& poll) {
  std::vector<OpenEdge> edges;
  const OpenEdgeSearch search{sets};
  for (int64_t cube = 0; cube < sets.cubes.centre.size; ++cube) {
    poll.At(cube);
    search.VisitItems(cube, [&edges](const OpenEdge& edge) { edges.push_back(edge); });
  }
  SortPolling(edges.begin(), edges.end(), poll, [](const OpenEdge& a, const OpenEdge& b) {
    return std::tuple(a.low, a.high, a.cube, a.direction, a.corner) <
           std::tuple(b.low, b.high, b.cube, b.direction, b.corner);
  });
  return edges;
}

std::vector<FacePair> CollectCuts(const CutSearch& search, const StopPoll& poll) {
  std::vector<FacePair> cuts;
  for (int64_t i = 0; i < search.edges.size; ++i) {
    poll.At(i);
    search.VisitItems(i, [&cuts](const FacePair& cut) { cuts.push_back(cut); });
  }
  std::stable_sort(cuts.begin(), cuts.end(),
                   [](const FacePair& a, const FacePair& b) { return a.score < b.score; });
  return cuts;
}

}  // namespace

int CloseCuts(const CutRules& rules, const StopPoll& poll, const MergeView& sets) {
  int total = 0;
  for (int round = 0; round < kMaxCutRounds; ++round) {
    const std::vector<OpenEdge> edges = CollectOpenEdges(sets, poll);
    const CutSearch search{
        sets.cubes, {edges.data(), static_cast<int64_t>(edges.size())}, rules.max_gap};
    int merged = 0;
    for (const FacePair& cut : CollectCuts(search, poll)) {
      merged += sets.TryGlue(cut, rules.collapse) ? 1 : 0;
    }
    total += merged;
    if (merged == 0) break;
  }
  return total;
}

}  // namespace amhex
