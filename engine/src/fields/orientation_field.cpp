#include "fields/orientation_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cuda/device_use.h"
#include "fields/field_loops.h"
#include "fields/frame_smoothing.h"
#include "fields/point_index.h"
#include "fields/quartic_form.h"

namespace amhex::fields {
namespace {

// Normals of samples within this distance (edge lengths) and 45 degrees count as one side's.
constexpr double kNormalReach = 1.0;
constexpr double kSameSideCosine = 0.7;
// Mean squared angle (radians) between them at which the hull's weight has halved: a ball of ten
// edge lengths' radius.
constexpr double kHalfTrustTurning = 0.006;

// What the hull adds to the neighbours' forms: for every normal n the form weight (n . x)^4, which
// is largest for frames with an axis along n. Where the hull turns within a cell no lattice can
// follow it, and a strong pull would only leave singular lines in the outermost layer: there the
// weight falls. Coarse nodes sum up their children.
struct HullForms {
  std::vector<int32_t> of_node;  // index into forms, -1 = none
  std::vector<QuarticForm> forms;
};

// Mean normal of the samples around one constraint, and how much to trust it.
struct MeanNormal {
  Vec3d direction;
  double flatness = 1;  // 1 = flat, towards 0 = turning within an edge length
};

class NormalsAround {
 public:
  explicit NormalsAround(const HullSamples& samples)
      : samples_(samples), index_(samples.position, kNormalReach) {}

  MeanNormal At(const HullConstraint& hull) const {
    Vec3d sum = hull.normal;
    int count = 1;
    index_.VisitNear(hull.point, kNormalReach, [&](int32_t s) {
      if (SquaredNorm(samples_.position[s] - hull.point) > kNormalReach * kNormalReach) return;
      if (Dot(samples_.normal[s], hull.normal) < kSameSideCosine) return;
      sum += samples_.normal[s];
      ++count;
    });
    const double length = Norm(sum);
    const double turning = 2 * (1 - length / count);  // mean squared angle
    return {sum / length, 1 / (1 + turning / kHalfTrustTurning)};
  }

 private:
  const HullSamples& samples_;
  PointIndex index_;
};

HullForms FinestHullForms(const BackgroundGrid& grid, const HullSamples& samples,
                          const OrientationSettings& settings, const RunContext& run) {
  const GridLevel& level = grid.fine();
  HullForms hull;
  hull.of_node = level.place_at_hull;
  hull.forms.resize(level.at_hull.nodes.size());
  const NormalsAround normals(samples);
  const double reach = kHullReach * grid.spacing;
  ForEach(run, level.at_hull.View().count(), [&](int64_t k) {
    const int32_t i = level.at_hull.nodes[k];
    QuarticForm& form = hull.forms[k];
    for (const HullConstraint& constraint : level.ConstraintsOf(i)) {
      const MeanNormal mean = normals.At(constraint);
      const double depth = std::abs(Dot(constraint.normal, constraint.point - grid.Position(i)));
      const double trust = 1 - settings.normal_fading * std::min(1.0, depth / reach);
      form.Add(FormOfAxis(mean.direction),
               static_cast<float>(settings.hull_weight * trust * mean.flatness));
    }
  });
  return hull;
}

// The user's guides pull like a flat hull, where no hull does.
void AddGuides(const GridLevel& level, double weight, HullForms* hull) {
  for (int64_t i = 0; i < level.count(); ++i) {
    const HullConstraints* guides = level.GuidesOf(i);
    if (guides == nullptr || hull->of_node[i] >= 0) continue;
    hull->of_node[i] = static_cast<int32_t>(hull->forms.size());
    QuarticForm& form = hull->forms.emplace_back();
    for (const HullConstraint& guide : *guides) {
      form.Add(FormOfAxis(guide.normal), static_cast<float>(weight));
    }
  }
}

HullForms ParentHullForms(const GridLevel& level, const HullForms& children, int64_t parent_count) {
  HullForms hull;
  hull.of_node.assign(parent_count, -1);
  for (int64_t i = 0; i < level.count(); ++i) {
    if (children.of_node[i] < 0) continue;
    int32_t& index = hull.of_node[level.parent[i]];
    if (index < 0) {
      index = static_cast<int32_t>(hull.forms.size());
      hull.forms.emplace_back();
    }
    hull.forms[index].Add(children.forms[children.of_node[i]], 1.0F);
  }
  return hull;
}

// The arrays of `level` and `hull` as views.
SmoothingLevel ViewOf(const GridLevel& level, const HullForms& hull) {
  const int64_t edge_count = level.count() * kNeighbourCount;
  SmoothingLevel view;
  view.neighbours = {level.neighbours.data()->data(), edge_count};
  if (!level.weights.empty()) view.weights = {level.weights.data()->data(), edge_count};
  view.hull_of_node = {hull.of_node.data(), level.count()};
  view.hull_forms = {hull.forms.data(), static_cast<int64_t>(hull.forms.size())};
  for (int k = 0; k < kColourCount; ++k) {
    view.colours[k] = {level.colours[k].data(), static_cast<int64_t>(level.colours[k].size())};
  }
  return view;
}

// Coarsest level first.
std::vector<SmoothingLevel> ViewLevels(const BackgroundGrid& grid,
                                       const std::vector<HullForms>& hull,
                                       const OrientationSettings& settings) {
  std::vector<SmoothingLevel> views;
  for (size_t l = grid.levels.size(); l-- > 0;) {
    SmoothingLevel& view = views.emplace_back(ViewOf(grid.levels[l], hull[l]));
    view.sweeps = l == 0 ? settings.fine_sweeps : settings.coarse_sweeps;
    if (views.size() > 1) view.parent = {grid.levels[l].parent.data(), view.node_count()};
  }
  return views;
}

}  // namespace

absl::StatusOr<OrientationField> SolveOrientationField(const BackgroundGrid& grid,
                                                       const HullSamples& samples,
                                                       const OrientationSettings& settings,
                                                       const ProgressSlice& slice) {
  std::vector<HullForms> hull{FinestHullForms(grid, samples, settings, slice.run())};
  AddGuides(grid.fine(), settings.hull_weight, &hull[0]);
  for (size_t l = 0; l + 1 < grid.levels.size(); ++l) {
    hull.push_back(ParentHullForms(grid.levels[l], hull[l], grid.levels[l + 1].count()));
  }
  SmoothingTask task;
  task.levels = ViewLevels(grid, hull, settings);
  task.cells = grid.Cells();
  task.frames_there = settings.frames_there;
  task.should_stop = [&slice] { return slice.run().ShouldStop(); };
  task.on_level = [&](int32_t level) {
    const int64_t done = task.levels[level].node_count();
    slice.Report(static_cast<double>(done) / static_cast<double>(grid.count()));
  };
  const absl::StatusOr<bool> outcome =
      RunWhereChosen(settings.device, &task, [&] { return SmoothFramesOnCpu(task); });
  if (!outcome.ok()) return outcome.status();
  if (absl::Status status = slice.run().CheckStop(); !status.ok()) return status;
  return OrientationField{std::move(task.frames), std::move(task.codes)};
}

}  // namespace amhex::fields
