#include "geometry/close_cuts.h"

#include <algorithm>
#include <tuple>

#include "base/sort_polling.h"

namespace amhex {
namespace {

constexpr int kMaxRounds = 8;
// Cosine between the normals of two faces that close a cut: at least 113 degrees apart.
constexpr double kMaxNormalCosine = -0.4;
// Cubes whose centres are nearer than this share of their size overlap: not a cut.
constexpr double kMinCentreDistance = 0.4;

// An open face at one of its merged edges.
struct OpenEdge {
  int low, high;  // merge sets of the edge's ends
  int cube, direction, corner;
};

struct Cut {
  double gap;
  OpenEdge a, b;
};

std::vector<OpenEdge> CollectOpenEdges(const Cubes& cubes, const MergeSets& sets,
                                       const FaceMatches& matches, const StopPoll& poll) {
  std::vector<OpenEdge> edges;
  for (int cube = 0; cube < cubes.count(); ++cube) {
    poll.At(cube);
    for (int direction = 0; direction < kDirectionCount; ++direction) {
      if (matches[cube][direction] >= 0) continue;
      const auto& ring = kCubeFaces[direction];
      for (int q = 0; q < 4; ++q) {
        const int a = sets.Find(8 * cube + ring[q]);
        const int b = sets.Find(8 * cube + ring[(q + 1) % 4]);
        if (a != b) edges.push_back({std::min(a, b), std::max(a, b), cube, direction, q});
      }
    }
  }
  SortPolling(edges.begin(), edges.end(), poll, [](const OpenEdge& a, const OpenEdge& b) {
    return std::tuple(a.low, a.high, a.cube, a.direction, a.corner) <
           std::tuple(b.low, b.high, b.cube, b.direction, b.corner);
  });
  return edges;
}

void CollectCut(const Cubes& cubes, const OpenEdge& a, const OpenEdge& b, double max_gap,
                std::vector<Cut>* cuts) {
  if (a.cube == b.cube) return;
  const double cosine =
      Dot(cubes.FaceNormal(a.cube, a.direction), cubes.FaceNormal(b.cube, b.direction));
  if (cosine > kMaxNormalCosine) return;
  const double size = cubes.mean_half[a.cube] + cubes.mean_half[b.cube];
  const double gap =
      Norm(cubes.FaceCentre(a.cube, a.direction) - cubes.FaceCentre(b.cube, b.direction)) / size;
  if (gap > max_gap) return;
  if (Norm(cubes.centre[a.cube] - cubes.centre[b.cube]) < kMinCentreDistance * size) return;
  cuts->push_back({gap, a, b});
}

std::vector<Cut> CollectCuts(const Cubes& cubes, const std::vector<OpenEdge>& edges,
                             double max_gap) {
  std::vector<Cut> cuts;
  for (size_t begin = 0; begin < edges.size();) {
    size_t end = begin + 1;
    while (end < edges.size() && edges[end].low == edges[begin].low &&
           edges[end].high == edges[begin].high) {
      ++end;
    }
    for (size_t i = begin; i < end; ++i) {
      for (size_t j = i + 1; j < end; ++j) CollectCut(cubes, edges[i], edges[j], max_gap, &cuts);
    }
    begin = end;
  }
  std::stable_sort(cuts.begin(), cuts.end(),
                   [](const Cut& a, const Cut& b) { return a.gap < b.gap; });
  return cuts;
}

// Corners of the two faces paired around the shared edge.
CornerPairs PairCorners(const Cut& cut) {
  CornerPairs pairs;
  for (int q = 0; q < 4; ++q) {
    pairs[q] = {8 * cut.a.cube + kCubeFaces[cut.a.direction][(cut.a.corner + q) % 4],
                8 * cut.b.cube + kCubeFaces[cut.b.direction][(cut.b.corner + 9 - q) % 4]};
  }
  return pairs;
}

}  // namespace

int CloseCuts(const Cubes& cubes, const CutRules& rules, const StopPoll& poll, MergeSets* sets,
              FaceMatches* matches) {
  int total = 0;
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::vector<OpenEdge> edges = CollectOpenEdges(cubes, *sets, *matches, poll);
    int merged = 0;
    for (const Cut& cut : CollectCuts(cubes, edges, rules.max_gap)) {
      int& match_a = (*matches)[cut.a.cube][cut.a.direction];
      int& match_b = (*matches)[cut.b.cube][cut.b.direction];
      if (match_a >= 0 || match_b >= 0) continue;
      const CornerPairs pairs = PairCorners(cut);
      const bool edge_is_shared = sets->Find(pairs[0].first) == sets->Find(pairs[0].second) &&
                                  sets->Find(pairs[1].first) == sets->Find(pairs[1].second);
      if (!edge_is_shared || !sets->CanMerge(pairs, rules.collapse)) continue;
      sets->Merge(pairs);
      match_a = 6 * cut.b.cube + cut.b.direction;
      match_b = 6 * cut.a.cube + cut.a.direction;
      ++merged;
    }
    total += merged;
    if (merged == 0) break;
  }
  return total;
}

}  // namespace amhex
