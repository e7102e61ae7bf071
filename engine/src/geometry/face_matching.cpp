#include "geometry/face_matching.h"

#include <algorithm>
#include <tuple>

#include "base/sort_polling.h"
#include "base/status_macros.h"
#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

// A link needs this many votes to count.
constexpr int kMinLinkVotes = 2;
// Cubes per block of the parallel loop: about a millisecond.
constexpr int64_t kCubesPerBlock = 256;

std::vector<LinkedFaces> LinkTable(const std::vector<FaceLink>& links) {
  std::vector<LinkedFaces> table;
  for (const FaceLink& link : links) {
    if (link.votes < kMinLinkVotes) continue;
    const int64_t a = 6 * int64_t{link.site_a} + link.direction_a;
    const int64_t b = 6 * int64_t{link.site_b} + link.direction_b;
    table.push_back({std::min(a, b), std::max(a, b)});
  }
  std::sort(table.begin(), table.end());
  return table;
}

}  // namespace

MatchScore ScoreFaces(const Cubes& cubes, int cube_a, int direction_a, int cube_b,
                      int direction_b) {
  const FaceFit fit = FitOfFaces(cubes.view(), cube_a, direction_a, cube_b, direction_b);
  return {ValueOf(fit), fit.rotation};
}

FaceSearch::FaceSearch(const Cubes& cubes, const std::vector<FaceLink>& links)
    : cubes_(cubes), bins_(cubes.centre, 1.0), links_(LinkTable(links)) {}

CandidateSearch FaceSearch::view() const {
  return {cubes_.view(), bins_.view(), {links_.data(), static_cast<int64_t>(links_.size())}};
}

absl::StatusOr<std::vector<FacePair>> CollectFacePairs(const CandidateSearch& search,
                                                       const RunContext& run) {
  std::vector<FacePair> pairs;
  AMHEX_RETURN_IF_ERROR(CollectFromBlocks(
      search.cubes.centre.size, kCubesPerBlock, run, &pairs,
      [&](int64_t begin, int64_t end, std::vector<FacePair>* found) {
        for (int64_t a = begin; a < end; ++a) {
          search.VisitItems(a, [found](const FacePair& pair) { found->push_back(pair); });
        }
      }));
  ParallelSortPolling(
      pairs.begin(), pairs.end(), StopPoll(run), [](const FacePair& a, const FacePair& b) {
        return std::tuple(a.score, a.cube_a, a.cube_b, a.direction_a, a.direction_b) <
               std::tuple(b.score, b.cube_a, b.cube_b, b.direction_a, b.direction_b);
      });
  return pairs;
}

}  // namespace amhex
