#include "fields/orientation_field.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "fields/field_loops.h"
#include "fields/point_index.h"
#include "fields/quartic_form.h"

namespace amhex::fields {
namespace {

// Ascent towards the neighbours' mean per visit; sweeps do the rest.
constexpr int kAscentRounds = 2;

float WeightOf(const GridLevel& level, int64_t node, int k) {
  if (!level.weights.empty()) return level.weights[node][k];
  return IsAxisNeighbour(k) ? kAxisWeight : kDiagonalWeight;
}

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

HullForms FinestHullForms(const GridLevel& level, const HullSamples& samples, double weight,
                          const RunContext& run) {
  HullForms hull;
  hull.of_node = level.constraint_of_node;
  hull.forms.resize(level.constraints.size());
  const NormalsAround normals(samples);
  ForEach(run, static_cast<int64_t>(hull.forms.size()), [&](int64_t k) {
    for (const HullConstraint& constraint : level.constraints[k]) {
      const MeanNormal mean = normals.At(constraint);
      hull.forms[k].Add(FormOfAxis(mean.direction), static_cast<float>(weight * mean.flatness));
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

// The neighbours' and the hull's wishes together.
QuarticForm WishesAt(const GridLevel& level, const HullForms& hull,
                     const std::vector<QuarticForm>& forms, int64_t node) {
  QuarticForm sum;
  if (const int32_t index = hull.of_node[node]; index >= 0) sum = hull.forms[index];
  RunWithWidestVectors([&] {
    for (int k = 0; k < kNeighbourCount; ++k) {
      const int32_t j = level.neighbours[node][k];
      if (j >= 0) sum.Add(forms[j], WeightOf(level, node, k));
    }
  });
  return sum;
}

// Moves the frames of up to kLanes nodes, none a neighbour of another.
void SmoothNodes(const GridLevel& level, const HullForms& hull, std::span<const int32_t> nodes,
                 std::vector<QuarticForm>* forms, std::vector<Quaternion>* frames) {
  FrameBatch batch;
  for (size_t lane = 0; lane < kLanes; ++lane) {
    const bool is_used = lane < nodes.size();  // the others repeat the first
    batch.forms[lane] = is_used ? WishesAt(level, hull, *forms, nodes[lane]) : batch.forms[0];
    batch.frames[lane] = (*frames)[nodes[is_used ? lane : 0]];
  }
  FindNearestFrames(kAscentRounds, &batch);
  for (size_t lane = 0; lane < nodes.size(); ++lane) {
    (*frames)[nodes[lane]] = batch.frames[lane];
    (*forms)[nodes[lane]] = FormOfFrame(batch.frames[lane]);
  }
}

// Calls body(nodes) for kLanes nodes at a time, from several threads.
template <class Body>
void ForBatches(const std::vector<int32_t>& nodes, const RunContext& run, const Body& body) {
  constexpr size_t kBatchesPerPoll = 32;  // some microseconds each
  using Range = oneapi::tbb::blocked_range<size_t>;
  const size_t batch_count = (nodes.size() + kLanes - 1) / kLanes;
  oneapi::tbb::parallel_for(Range(0, batch_count, kBatchesPerPoll), [&](const Range& range) {
    if (run.ShouldStop()) return;
    for (size_t b = range.begin(); b < range.end(); ++b) {
      const size_t begin = b * kLanes;
      body(std::span(nodes).subspan(begin, std::min<size_t>(kLanes, nodes.size() - begin)));
    }
  });
}

absl::Status SmoothLevel(const GridLevel& level, const HullForms& hull, int sweeps,
                         const RunContext& run, std::vector<Quaternion>* frames) {
  std::vector<QuarticForm> forms(level.count());
  ForEach(run, level.count(), [&](int64_t i) { forms[i] = FormOfFrame((*frames)[i]); });
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (int step = 0; step < 8; ++step) {
      const std::vector<int32_t>& colour = level.colours[(sweep & 1) != 0 ? 7 - step : step];
      ForBatches(colour, run, [&](std::span<const int32_t> nodes) {
        SmoothNodes(level, hull, nodes, &forms, frames);
      });
      if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<Quaternion>> SolveOrientationField(const BackgroundGrid& grid,
                                                              const HullSamples& samples,
                                                              const OrientationSettings& settings,
                                                              const ProgressSlice& slice) {
  std::vector<HullForms> hull{
      FinestHullForms(grid.fine(), samples, settings.hull_weight, slice.run())};
  AddGuides(grid.fine(), settings.hull_weight, &hull[0]);
  for (size_t l = 0; l + 1 < grid.levels.size(); ++l) {
    hull.push_back(ParentHullForms(grid.levels[l], hull[l], grid.levels[l + 1].count()));
  }
  std::vector<Quaternion> frames(grid.levels.back().count());
  for (size_t l = grid.levels.size(); l-- > 0;) {
    const GridLevel& level = grid.levels[l];
    if (l + 1 < grid.levels.size()) {
      std::vector<Quaternion> finer(level.count());
      for (int64_t i = 0; i < level.count(); ++i) finer[i] = frames[level.parent[i]];
      frames = std::move(finer);
    }
    const int sweeps = l == 0 ? settings.fine_sweeps : settings.coarse_sweeps;
    if (absl::Status s = SmoothLevel(level, hull[l], sweeps, slice.run(), &frames); !s.ok()) {
      return s;
    }
    slice.Report(static_cast<double>(level.count()) / static_cast<double>(grid.count()));
  }
  return frames;
}

ForwardCodes MatchNeighbours(const GridLevel& level, const std::vector<Quaternion>& frames,
                             const RunContext& run) {
  ForwardCodes codes(level.count());
  ForEach(run, level.count(), [&](int64_t i) {
    for (int k = 0; k < 3; ++k) {
      const int32_t j = level.neighbours[i][k];
      codes[i][k] = j < 0 ? uint8_t{0} : static_cast<uint8_t>(MatchCode(frames[i], frames[j]));
    }
  });
  return codes;
}

NearestAxis FindNearestAxis(const AxisFrame& frame, const Vec3d& normal) {
  NearestAxis nearest{0, 1, -1};
  for (int axis = 0; axis < 3; ++axis) {
    const double c = Dot(frame.axis[axis], normal);
    if (std::abs(c) > nearest.cosine) nearest = {axis, c < 0 ? -1.0 : 1.0, std::abs(c)};
  }
  return nearest;
}

}  // namespace amhex::fields
