#include "geometry/face_matching.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "base/sort_polling.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "geometry/face_candidates.h"
#include "geometry/match_task.h"
#include "geometry/point_bins.h"
#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

// A link needs this many votes to count.
constexpr int kMinLinkVotes = 2;
// Cubes per block of the parallel loop: about a millisecond.
constexpr int64_t kCubesPerBlock = 256;
constexpr int64_t kCandidatesPerBlock = 16384;

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

// eq. 5
double ValueOf(const FaceFit& fit) {
  return fit.distance * (2.0 - std::acos(fit.cosine) / std::numbers::pi);
}

// Appends the pair unless its score is too bad.
void Judge(const Cubes& cubes, const FaceCandidate& candidate, std::vector<FacePair>* pairs) {
  const int a = candidate.cube_a, b = candidate.cube_b;
  const double size = cubes.mean_half[a] + cubes.mean_half[b];
  double score = ValueOf(candidate.fit) / (4 * size);
  if (candidate.is_linked != 0) score *= kLinkFactor;
  if (score >= kMaxScore) return;
  pairs->push_back({score, a, b, candidate.direction_a, candidate.direction_b,
                    static_cast<uint8_t>(candidate.fit.rotation)});
}

}  // namespace

MatchScore ScoreFaces(const Cubes& cubes, int cube_a, int direction_a, int cube_b,
                      int direction_b) {
  const FaceFit fit = FitOfFaces(cubes.view(), cube_a, direction_a, cube_b, direction_b);
  return {ValueOf(fit), fit.rotation};
}

CornerPairs CornersToMerge(const FacePair& pair) {
  CornerPairs corners;
  for (int q = 0; q < 4; ++q) {
    corners[q] = {8 * pair.cube_a + kCubeFaces[pair.direction_a][q],
                  8 * pair.cube_b + kCubeFaces[pair.direction_b][(pair.rotation + 4 - q) % 4]};
  }
  return corners;
}

absl::StatusOr<std::vector<FacePair>> CollectFacePairs(const Cubes& cubes,
                                                       const std::vector<FaceLink>& links,
                                                       const RunContext& run, DeviceUse* device) {
  const PointBins bins(cubes.centre, 1.0);
  const std::vector<LinkedFaces> table = LinkTable(links);
  MatchTask task{{cubes.view(), bins.view(), {table.data(), static_cast<int64_t>(table.size())}},
                 {},
                 [&run] { return run.ShouldStop(); }};
  std::vector<FacePair> pairs;
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    AMHEX_RETURN_IF_ERROR(CollectFromBlocks(
        cubes.count(), kCubesPerBlock, run, &pairs,
        [&](int64_t begin, int64_t end, std::vector<FacePair>* found) {
          for (int64_t a = begin; a < end; ++a) {
            task.search.VisitItems(
                a, [&](const FaceCandidate& candidate) { Judge(cubes, candidate, found); });
          }
        }));
    return true;
  };
  AMHEX_RETURN_IF_ERROR(RunWhereChosen(device, &task, on_cpu).status());
  // What a device found; nothing after the CPU.
  const auto found_there = static_cast<int64_t>(task.candidates.size());
  AMHEX_RETURN_IF_ERROR(
      CollectFromBlocks(found_there, kCandidatesPerBlock, run, &pairs,
                        [&](int64_t begin, int64_t end, std::vector<FacePair>* found) {
                          for (int64_t i = begin; i < end; ++i) {
                            Judge(cubes, task.candidates[static_cast<size_t>(i)], found);
                          }
                        }));
  SortPolling(pairs.begin(), pairs.end(), StopPoll(run), [](const FacePair& a, const FacePair& b) {
    return std::tuple(a.score, a.cube_a, a.cube_b, a.direction_a, a.direction_b) <
           std::tuple(b.score, b.cube_a, b.cube_b, b.direction_a, b.direction_b);
  });
  return pairs;
}

}  // namespace amhex
