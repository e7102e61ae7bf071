#include "geometry/face_matching.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "base/sort_polling.h"
#include "geometry/point_bins.h"
#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

// Cubes farther apart than this many of their sizes cannot share a face.
constexpr double kMaxCentreDistance = 1.7;
// Cosine between a face normal and the line of centres (about 53 degrees).
constexpr double kMinFacing = 0.6;
// Worst score (in four mean sizes) that is ever merged: the last level of match_and_merge.cpp.
constexpr double kMaxScore = 0.8;
// A link needs this many votes to count, and then halves the score.
constexpr int kMinLinkVotes = 2;
constexpr double kLinkFactor = 0.5;
// Cubes per block of the parallel loop: about a millisecond.
constexpr int64_t kCubesPerBlock = 256;

class LinkTable {
 public:
  explicit LinkTable(const std::vector<FaceLink>& links) {
    for (const FaceLink& link : links) {
      if (link.votes < kMinLinkVotes) continue;
      const int64_t a = 6 * int64_t{link.site_a} + link.direction_a;
      const int64_t b = 6 * int64_t{link.site_b} + link.direction_b;
      pairs_.emplace_back(std::min(a, b), std::max(a, b));
    }
    std::sort(pairs_.begin(), pairs_.end());
  }
  bool Contains(int cube_a, int direction_a, int cube_b, int direction_b) const {
    const int64_t a = 6 * int64_t{cube_a} + direction_a;
    const int64_t b = 6 * int64_t{cube_b} + direction_b;
    return std::binary_search(pairs_.begin(), pairs_.end(),
                              std::pair{std::min(a, b), std::max(a, b)});
  }

 private:
  std::vector<std::pair<int64_t, int64_t>> pairs_;
};

void CollectBetween(const Cubes& cubes, const LinkTable& links, int a, int b,
                    std::vector<FacePair>* pairs) {
  const Vec3d d = cubes.centre[b] - cubes.centre[a];
  const double distance = Norm(d);
  const double size = cubes.mean_half[a] + cubes.mean_half[b];
  if (distance > kMaxCentreDistance * size) return;
  for (int u = 0; u < kDirectionCount; ++u) {
    if (Dot(cubes.FaceNormal(a, u), d) < kMinFacing * distance) continue;
    for (int v = 0; v < kDirectionCount; ++v) {
      if (Dot(cubes.FaceNormal(b, v), d) > -kMinFacing * distance) continue;
      const MatchScore match = ScoreFaces(cubes, a, u, b, v);
      double score = match.value / (4 * size);
      if (links.Contains(a, u, b, v)) score *= kLinkFactor;
      if (score >= kMaxScore) continue;
      pairs->push_back({score, a, b, static_cast<uint8_t>(u), static_cast<uint8_t>(v),
                        static_cast<uint8_t>(match.rotation)});
    }
  }
}

}  // namespace

MatchScore ScoreFaces(const Cubes& cubes, int cube_a, int direction_a, int cube_b,
                      int direction_b) {
  std::array<Vec3d, 4> u, v;
  for (int q = 0; q < 4; ++q) {
    u[q] = cubes.VirtualVertex(8 * cube_a + kCubeFaces[direction_a][q]);
    v[q] = cubes.VirtualVertex(8 * cube_b + kCubeFaces[direction_b][q]);
  }
  MatchScore best{1e300, 0};
  for (int rotation = 0; rotation < 4; ++rotation) {
    double sum = 0;
    for (int q = 0; q < 4; ++q) sum += Norm(u[q] - v[(rotation + 4 - q) % 4]);
    if (sum < best.value) best = {sum, rotation};
  }
  const double cosine = std::clamp(
      Dot(cubes.FaceNormal(cube_a, direction_a), cubes.FaceNormal(cube_b, direction_b)), -1.0, 1.0);
  best.value *= 2.0 - std::acos(cosine) / std::numbers::pi;  // eq. 5
  return best;
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
                                                       const RunContext& run) {
  std::vector<FacePair> pairs;
  const LinkTable link_table(links);
  const PointBins bins(cubes.centre, 1.0);
  const auto collect = [&](int64_t begin, int64_t end, std::vector<FacePair>* found) {
    for (auto a = static_cast<int>(begin); a < end; ++a) {
      // A pair is collected from its larger cube (ties: smaller index), whose reach covers both.
      const double reach = kMaxCentreDistance * 2 * cubes.mean_half[a];
      bins.ForEachWithin(cubes.centre[a], reach, [&](int b) {
        if (std::tuple(-cubes.mean_half[a], a) < std::tuple(-cubes.mean_half[b], b)) {
          CollectBetween(cubes, link_table, a, b, found);
        }
      });
    }
  };
  const absl::Status status =
      CollectFromBlocks(cubes.count(), kCubesPerBlock, run, &pairs, collect);
  if (!status.ok()) return status;
  SortPolling(pairs.begin(), pairs.end(), StopPoll(run), [](const FacePair& a, const FacePair& b) {
    return std::tuple(a.score, a.cube_a, a.cube_b, a.direction_a, a.direction_b) <
           std::tuple(b.score, b.cube_a, b.cube_b, b.direction_a, b.direction_b);
  });
  return pairs;
}

}  // namespace amhex
