#include "geometry/match_and_merge.h"

#include <utility>

#include "base/array_view_of.h"
#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "cuda/device_use.h"
#include "exec/cpu_executor.h"
#include "geometry/close_cuts.h"
#include "geometry/cubes.h"
#include "geometry/face_matching.h"
#include "geometry/label_hull_impl.h"
#include "geometry/match_task.h"
#include "geometry/merge_sets.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

// Works off the queue up to the score; pairs with a merged face are skipped (left open).
void MatchLevel(const std::vector<FacePair>& queue, double max_score, Collapse collapse,
                const StopPoll& poll, const MergeView& sets) {
  int64_t visited = 0;
  for (const FacePair& pair : queue) {
    poll.At(++visited);
    if (pair.score > max_score) break;
    sets.TryGlue(pair, collapse);
  }
}

// Real vertices: the average of each merge set, numbered by first virtual vertex.
void CollectVertices(const MergeView& sets, const StopPoll& poll, MatchTask* task) {
  const int64_t virtual_count = sets.parent.size;
  std::vector<int32_t> vertex_of_set(static_cast<size_t>(virtual_count), -1);
  std::vector<int32_t> members;
  std::vector<Vec3d> vertices;
  std::vector<CellCorners> corners(static_cast<size_t>(virtual_count / 8));
  for (int32_t v = 0; v < virtual_count; ++v) {
    poll.At(v);
    const int32_t set = sets.Find(v);
    if (vertex_of_set[set] < 0) {
      vertex_of_set[set] = static_cast<int32_t>(vertices.size());
      vertices.push_back({});
      members.push_back(0);
    }
    const int32_t id = vertex_of_set[set];
    corners[v / 8][v % 8] = id;
    vertices[id] += sets.cubes.VirtualVertex(v);
    ++members[id];
  }
  for (size_t i = 0; i < members.size(); ++i) vertices[i] /= members[i];
  task->vertices = std::move(vertices), task->corners = std::move(corners);
}

void LabelOnCpu(const Cubes& cubes, const HullView& hull, MatchTask* task) {
  task->hull_faces.resize(task->corners.size());
  task->on_hull.resize(task->vertices.size());
  CpuExecutor executor(task->should_stop);
  LabelHull(executor, hull,
            {cubes.view(), ArrayViewOf(task->vertices), ArrayViewOf(task->corners),
             ArrayViewOf(task->matches)},
            {WritableViewOf(task->hull_faces), WritableViewOf(task->on_hull)},
            WritableViewOf(task->vertices));
}

absl::StatusOr<bool> MergeOnCpu(const Cubes& cubes, const HullQueries* hull, const RunContext& run,
                                MatchTask* task) {
  CandidateSearch search = task->search;
  if (hull != nullptr) search.cubes.hull = hull->view();
  AMHEX_ASSIGN_OR_RETURN(const std::vector<FacePair> queue, CollectFacePairs(search, run));
  const MergeSets sets(cubes);
  MergeView view = sets.view();
  view.cubes.hull = search.cubes.hull;
  const StopPoll poll(run);
  for (const Collapse collapse : kMatchPasses) {
    for (const double level : kMatchLevels) {
      MatchLevel(queue, level, collapse, poll, view);
      AMHEX_RETURN_IF_ERROR(CloseCuts({level + kCutMargin, collapse}, run, view).status());
      task->on_level();
    }
  }
  CollectVertices(view, poll, task);
  task->matches = sets.matches();
  return true;
}

}  // namespace

absl::StatusOr<MergedCubes> MergeCubes(const Cubes& cubes, const std::vector<FaceLink>& links,
                                       RunContext& run, DeviceUse* device,
                                       const HullQueries* hull) {
  Progress progress = run.progress();
  progress.site_count = cubes.count();
  progress.stage_fraction = 0;
  const FaceSearch search(cubes, links);
  MatchTask task;
  task.search = search.view();
  if (hull != nullptr) task.hull = hull->view_if_here(), task.resident = &hull->resident();
  task.on_level = [&] {
    progress.stage_fraction += 1.0 / (kMatchPasses.size() * kMatchLevels.size());
    run.Report(progress);
  };
  task.should_stop = [&run] { return run.ShouldStop(); };
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    progress.stage_fraction = 0;
    AMHEX_ASSIGN_OR_RETURN(const bool is_done, MergeOnCpu(cubes, hull, run, &task));
    if (hull != nullptr) LabelOnCpu(cubes, hull->view(), &task);
    return is_done;
  };
  AMHEX_RETURN_IF_ERROR(RunWhereChosen(device, &task, on_cpu).status());
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  MergedCubes merged;
  merged.vertices = std::move(task.vertices), merged.corners = std::move(task.corners);
  merged.matches = std::move(task.matches);
  merged.hull_faces = std::move(task.hull_faces), merged.on_hull = std::move(task.on_hull);
  return merged;
}

absl::StatusOr<MergedCubes> MatchAndMerge(const Sites& sites, const Hull& hull,
                                          const MeshingParams& params, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(params.run.backend));
  const Cubes cubes = MaterializeCubes(sites);
  AMHEX_ASSIGN_OR_RETURN(MergedCubes merged,
                         MergeCubes(cubes, sites.links, run, &device, hull.queries.get()));
  merged.device_notes = device.notes();
  return merged;
}

}  // namespace amhex
