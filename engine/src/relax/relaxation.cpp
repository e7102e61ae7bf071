#include "relax/relaxation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "input/ask_hull.h"
#include "orientation/frames.h"
#include "relax/build_barrier.h"
#include "relax/relaxation_cpu.h"
#include "relax/relaxation_task.h"
#include "relax/thin_samples.h"

namespace amhex {
namespace {

// Section 6.2.
constexpr int32_t kIterationsAfterGrids = 150;
// Room around the hull, edge lengths: for outside sites one hop away and their cells.
constexpr double kMarginWithOutside = 3.0;
constexpr double kMarginInsideOnly = 1.0;
// Sizes beyond these have no cubes worth relaxing; they would widen every search.
constexpr double kLeastSize = 0.25;
constexpr double kLargestSize = 4.0;
// Below this confidence a tangent is noise and only the normal is taken (section 4.3).
constexpr float kTrustedCurvature = 0.5f;

absl::StatusOr<std::vector<int32_t>> LabelSides(const HullAsker& hull,
                                                const std::vector<Vec3d>& position) {
  AMHEX_ASSIGN_OR_RETURN(const std::vector<HullSide> sides,
                         hull.Ask(SideOf<PlainPoints>{PointsOf(position)}));
  std::vector<int32_t> is_inside;
  is_inside.reserve(sides.size());
  for (const HullSide side : sides) is_inside.push_back(side == HullSide::kInside ? 1 : 0);
  return is_inside;
}

Vec3f ClampedSize(const Vec3d& size) {
  return ToFloat(Vec3d{std::clamp(size.x, kLeastSize, kLargestSize),
                       std::clamp(size.y, kLeastSize, kLargestSize),
                       std::clamp(size.z, kLeastSize, kLargestSize)});
}

void AddSites(const Sites& sites, RelaxationTask& task) {
  for (size_t i = 0; i < sites.position.size(); ++i) {
    task.position.push_back(sites.position[i] - task.barrier.origin);
    task.orientation.push_back(QuatFromFrame(sites.frame[i]));
    task.size.push_back(ClampedSize(sites.size[i]));
  }
}

void AddSamples(const HullSamples& samples, RelaxationTask& task) {
  const HullSamples thinned = ThinSamples(samples);
  for (size_t i = 0; i < thinned.position.size(); ++i) {
    task.sample_position.push_back(ToFloat(thinned.position[i] - task.barrier.origin));
    task.sample_normal.push_back(ToFloat(thinned.normal[i]));
    const bool is_trusted = thinned.curvature_confidence[i] >= kTrustedCurvature;
    task.sample_orientation.push_back(
        SampleOrientation(thinned.normal[i], is_trusted ? thinned.tangent[i] : Vec3d{}));
  }
}

absl::StatusOr<HullBarrier> BarrierAround(const Hull& hull, const std::vector<int32_t>& is_inside,
                                          const RelaxationParams& params, RunContext& run) {
  const auto inside_count = std::count(is_inside.begin(), is_inside.end(), 1);
  if (inside_count == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "sizing: none of ", is_inside.size(),
        " sites lies inside the input; its walls are thinner than the wanted edge length"));
  }
  const bool has_outside = inside_count < static_cast<int64_t>(is_inside.size());
  return BuildHullBarrier(hull, params.lattice_points_per_site,
                          has_outside ? kMarginWithOutside : kMarginInsideOnly, run);
}

RelaxationTask MakeTask(const HullSamples& samples, const Sites& sites,
                        const RelaxationParams& params, std::vector<int32_t> is_inside,
                        HullBarrier barrier) {
  RelaxationTask task;
  task.is_inside = std::move(is_inside);
  task.barrier = std::move(barrier);
  AddSites(sites, task);
  AddSamples(samples, task);
  std::vector<Vec3d> outside_positions;
  for (size_t i = 0; i < task.position.size(); ++i) {
    if (task.is_inside[i] == 0) outside_positions.push_back(task.position[i]);
  }
  task.items = ListLabelItems(task.barrier, outside_positions);
  task.iteration_count = ResolveIterationCount(params);
  task.regularity_weight = params.regularity_weight;
  task.split_limit = params.split_limit;
  task.propagates_orientation = params.initialization != Initialization::kField;
  return task;
}

void ObserveTask(RelaxationTask& task, RunContext& run) {
  task.should_stop = [&run] { return run.ShouldStop(); };
  const int32_t iteration_count = task.iteration_count;
  task.on_iteration = [&run, iteration_count](int32_t iteration, double movement, int64_t sites) {
    Progress progress = run.progress();
    progress.stage_fraction = static_cast<double>(iteration) / (iteration_count + 1);
    progress.iteration = iteration;
    progress.iteration_count = iteration_count;
    progress.mean_movement = movement;
    progress.site_count = sites;
    run.Report(progress);
  };
}

// Links between sites that both stay, under their new numbers.
std::vector<FaceLink> RenumberedLinks(const std::vector<FaceLink>& links,
                                      const std::vector<int32_t>& new_id) {
  std::vector<FaceLink> kept;
  for (FaceLink link : links) {
    link.site_a = new_id[static_cast<size_t>(link.site_a)];
    link.site_b = new_id[static_cast<size_t>(link.site_b)];
    if (link.site_a >= 0 && link.site_b >= 0) kept.push_back(link);
  }
  return kept;
}

Sites TakeInsideSites(const Sites& before, const RelaxationTask& task) {
  const bool is_moved = task.iteration_count > 0;
  Sites after;
  std::vector<int32_t> new_id(task.position.size(), -1);
  for (size_t i = 0; i < task.position.size(); ++i) {
    if (task.is_inside[i] == 0) continue;
    new_id[i] = static_cast<int32_t>(after.position.size());
    const bool is_original = i < before.position.size();
    after.position.push_back(is_moved ? task.position[i] + task.barrier.origin
                                      : before.position[i]);
    after.frame.push_back(is_moved ? FrameFromQuat(task.orientation[i]) : before.frame[i]);
    after.size.push_back(is_original ? before.size[i] : ToDouble(task.size[i]));
    after.cell_volume.push_back(static_cast<double>(task.point_count[i]) *
                                task.barrier.lattice.point_volume());
  }
  if (task.split_count == 0) after.links = RenumberedLinks(before.links, new_id);
  return after;
}

}  // namespace

int32_t ResolveIterationCount(const RelaxationParams& params) {
  if (params.iteration_count >= 0) return params.iteration_count;
  return params.initialization == Initialization::kField ? 0 : kIterationsAfterGrids;
}

absl::StatusOr<Sites> RelaxSites(const Hull& hull, const HullSamples& samples, const Sites& sites,
                                 const MeshingParams& params, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(params.run.backend));
  try {
    const HullAsker asker(*hull.queries, &device, StopPoll(run));
    AMHEX_ASSIGN_OR_RETURN(std::vector<int32_t> is_inside, LabelSides(asker, sites.position));
    AMHEX_ASSIGN_OR_RETURN(HullBarrier barrier,
                           BarrierAround(hull, is_inside, params.relaxation, run));
    RelaxationTask task =
        MakeTask(samples, sites, params.relaxation, std::move(is_inside), std::move(barrier));
    ObserveTask(task, run);
    const auto on_cpu = [&] { return RelaxOnCpu(task) == RelaxationOutcome::kDone; };
    AMHEX_ASSIGN_OR_RETURN(const bool is_done, device.Run(&task, on_cpu));
    if (!is_done) {
      AMHEX_RETURN_IF_ERROR(run.CheckStop());
      return absl::InternalError("the relaxation stopped without being asked to");
    }
    Sites relaxed = TakeInsideSites(sites, task);
    relaxed.device_notes = sites.device_notes;
    relaxed.device_notes.insert(relaxed.device_notes.end(), device.notes().begin(),
                                device.notes().end());
    return relaxed;
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(
        absl::StrCat("not enough memory to relax ", sites.count(), " sites"));
  }
}

}  // namespace amhex
