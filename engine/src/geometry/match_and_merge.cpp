#include "geometry/match_and_merge.h"

#include <algorithm>
#include <array>

#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "cuda/device_use.h"
#include "geometry/close_cuts.h"
#include "geometry/cubes.h"
#include "geometry/face_matching.h"
#include "geometry/hull_faces.h"
#include "geometry/merge_sets.h"
#include "input/ask_hull.h"

namespace amhex {
namespace {

// Deviates from the paper's single pass over the queue: good matches first, and after each level
// the cuts it opened are closed, so that certain merges decide the doubtful ones.
constexpr std::array<double, 7> kLevels = {0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.8};
// A cut may be this much wider than the level's matches, in mean cell sizes.
constexpr double kCutMargin = 0.25;

struct MatchRules {
  double max_score;
  Collapse collapse;
};

// Works off the queue up to the score; pairs with a merged face are skipped (left open).
void MatchLevel(const std::vector<FacePair>& queue, const MatchRules& rules, const StopPoll& poll,
                MergeSets* sets, FaceMatches* matches) {
  int64_t visited = 0;
  for (const FacePair& pair : queue) {
    poll.At(++visited);
    if (pair.score > rules.max_score) break;
    int& match_a = (*matches)[pair.cube_a][pair.direction_a];
    int& match_b = (*matches)[pair.cube_b][pair.direction_b];
    if (match_a >= 0 || match_b >= 0) continue;
    const CornerPairs corners = CornersToMerge(pair);
    if (!sets->CanMerge(corners, rules.collapse)) continue;
    sets->Merge(corners);
    match_a = 6 * pair.cube_b + pair.direction_b;
    match_b = 6 * pair.cube_a + pair.direction_a;
  }
}

// Real vertices: the average of each merge set, numbered by first virtual vertex.
void CollectVertices(const Cubes& cubes, const MergeSets& sets, const StopPoll& poll,
                     MergedCubes* merged) {
  const int virtual_count = 8 * cubes.count();
  std::vector<int32_t> vertex_of_set(virtual_count, -1);
  std::vector<int32_t> members;
  merged->corners.resize(cubes.count());
  for (int v = 0; v < virtual_count; ++v) {
    poll.At(v);
    const int set = sets.Find(v);
    if (vertex_of_set[set] < 0) {
      vertex_of_set[set] = static_cast<int32_t>(merged->vertices.size());
      merged->vertices.push_back({});
      members.push_back(0);
    }
    const int32_t id = vertex_of_set[set];
    merged->corners[v / 8][v % 8] = id;
    merged->vertices[id] += cubes.VirtualVertex(v);
    ++members[id];
  }
  for (size_t i = 0; i < members.size(); ++i) merged->vertices[i] /= members[i];
}

}  // namespace

absl::StatusOr<MergedCubes> MatchAndMerge(const Sites& sites, const Hull& hull,
                                          const MeshingParams& params, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(params.run.backend));
  const Cubes cubes = MaterializeCubes(sites);
  AMHEX_ASSIGN_OR_RETURN(const std::vector<FacePair> queue,
                         CollectFacePairs(cubes, sites.links, run, &device));
  MergeSets sets(cubes);
  FaceMatches matches(cubes.count(), {-1, -1, -1, -1, -1, -1});

  const StopPoll poll(run);
  Progress progress = run.progress();
  progress.site_count = sites.count();
  progress.stage_fraction = 0;
  for (const Collapse collapse : {Collapse::kForbidden, Collapse::kEdgesOnly}) {
    for (const double level : kLevels) {
      MatchLevel(queue, {level, collapse}, poll, &sets, &matches);
      CloseCuts(cubes, {level + kCutMargin, collapse}, poll, &sets, &matches);
      progress.stage_fraction += 0.5 / kLevels.size();
      run.Report(progress);
    }
  }

  MergedCubes merged;
  merged.matches.assign(matches.begin(), matches.end());
  CollectVertices(cubes, sets, poll, &merged);
  AMHEX_RETURN_IF_ERROR(LabelHullFaces(cubes, HullAsker(*hull.queries, &device, poll), &merged));
  merged.device_notes = device.notes();
  return merged;
}

}  // namespace amhex
