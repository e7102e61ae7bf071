#include "fields/orientation_field.h"

#include <cmath>

#include "fields/quartic_form.h"

namespace amhex::fields {
namespace {

// The normals' pull is not linear in the frame: repeated so often per visit.
constexpr int kPullRounds = 3;
// Ascent towards the neighbours' mean per visit; sweeps do the rest.
constexpr int kAscentRounds = 2;

float WeightOf(const GridLevel& level, int64_t node, int k) {
  if (!level.weights.empty()) return level.weights[node][k];
  return IsAxisNeighbour(k) ? kAxisWeight : kDiagonalWeight;
}

// The frame nearest to the neighbours' together.
Quaternion SmoothedFrame(const GridLevel& level, const std::vector<QuarticForm>& forms,
                         const Quaternion& start, int64_t node) {
  QuarticForm sum;
  for (int k = 0; k < kNeighbourCount; ++k) {
    const int32_t j = level.neighbours[node][k];
    if (j >= 0) sum.Add(forms[j], WeightOf(level, node, k));
  }
  return NearestFrame(sum, start, kAscentRounds);
}

Quaternion PulledToNormals(const Quaternion& smoothed, const HullConstraints& constraints,
                           const OrientationSettings& settings) {
  const double keep =
      constraints.count > 1 ? settings.smooth_weight_several : settings.smooth_weight_one;
  Quaternion frame = smoothed;
  for (int round = 0; round < kPullRounds; ++round) {
    Quaternion sum = Scaled(frame, keep);
    for (const HullConstraint& constraint : constraints) {
      sum = AddAligned(sum, AlignedToNormal(frame, constraint.normal), settings.normal_weight);
    }
    frame = Normalized(sum);
  }
  return frame;
}

absl::Status SmoothLevel(const GridLevel& level, const OrientationSettings& settings, int sweeps,
                         const RunContext& run, std::vector<Quaternion>* frames) {
  std::vector<QuarticForm> forms(level.count());
  ForEach(run, level.count(), [&](int64_t i) { forms[i] = FormOfFrame((*frames)[i]); });
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (int step = 0; step < 8; ++step) {
      const std::vector<int32_t>& colour = level.colours[(sweep & 1) != 0 ? 7 - step : step];
      ForEach(run, static_cast<int64_t>(colour.size()), [&](int64_t c) {
        const int32_t node = colour[c];
        Quaternion frame = SmoothedFrame(level, forms, (*frames)[node], node);
        if (const HullConstraints* constraints = level.ConstraintsOf(node)) {
          frame = PulledToNormals(frame, *constraints, settings);
        }
        (*frames)[node] = frame;
        forms[node] = FormOfFrame(frame);
      });
      if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<Quaternion>> SolveOrientationField(const BackgroundGrid& grid,
                                                              const OrientationSettings& settings,
                                                              const ProgressSlice& slice) {
  std::vector<Quaternion> frames(grid.levels.back().count());
  for (size_t l = grid.levels.size(); l-- > 0;) {
    const GridLevel& level = grid.levels[l];
    if (l + 1 < grid.levels.size()) {
      std::vector<Quaternion> finer(level.count());
      for (int64_t i = 0; i < level.count(); ++i) finer[i] = frames[level.parent[i]];
      frames = std::move(finer);
    }
    const int sweeps = l == 0 ? settings.fine_sweeps : settings.coarse_sweeps;
    if (absl::Status s = SmoothLevel(level, settings, sweeps, slice.run(), &frames); !s.ok()) {
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
