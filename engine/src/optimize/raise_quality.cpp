#include "optimize/raise_quality.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>

namespace amhex {
namespace {

constexpr float kLargestStep = 0.3F;
constexpr float kSmallestStep = 0.002F;
constexpr int kMaxHalvings = 4;
constexpr size_t kCellsPerBlock = 1024;
// Gains below these are not worth another sweep of the neighbourhood.
constexpr double kMinRelativeEnergyGain = 1e-4;
constexpr double kMinAverageGain = 1e-4;

// The directions in which the vertex may move, an orthonormal set.
struct FreeAxes {
  int count = 0;
  std::array<Vec3d, 3> axis;
};

FreeAxes AxesAt(const VertexConstraint& constraint, const ConstrainedPoint& at) {
  switch (constraint.kind) {
    case Constraint::kFree:
      return {3, {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}};
    case Constraint::kPatch: {
      const Vec3d& n = at.normal;
      const Vec3d helper = std::abs(n.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
      const Vec3d u = Normalized(Cross(n, helper));
      return {2, {u, Cross(n, u), Vec3d{}}};
    }
    case Constraint::kCrease:
      return {1, {at.direction, Vec3d{}, Vec3d{}}};
    case Constraint::kCorner:
    case Constraint::kFixed:
      break;
  }
  return {};
}

bool IsGain(const LocalScore& before, const LocalScore& after, QualityAim aim) {
  if (aim == QualityAim::kMinimum) {
    return after.energy < before.energy * (1 - kMinRelativeEnergyGain);
  }
  return after.energy < before.energy - kMinAverageGain;
}

// Line search along the falling energy. Returns true if the vertex moved.
class VertexSearch {
 public:
  VertexSearch(Placement& placement, const SweepRules& rules,
               const std::vector<uint8_t>& near_folding, int32_t v)
      : placement_(placement),
        rules_(rules),
        v_(v),
        judge_(placement, v, rules.penalty, near_folding) {}

  bool Run(float& step) {
    const VertexConstraint& constraint = placement_.constraints.vertex[v_];
    start_ = placement_.complex.vertices[v_];
    const ConstrainedPoint at = Constrain(constraint, start_, placement_.features);
    // A vertex that has not reached the hull keeps its offset while it slides.
    foot_ = at.point;
    offset_ = start_ - foot_;
    const FreeAxes axes = AxesAt(constraint, at);
    if (axes.count == 0) return false;
    const Vec3d gradient =
        judge_.cells().EnergyGradient(axes.axis, axes.count, judge_.score().energy);
    const double slope = Norm(gradient);
    if (!(slope > 0) || !std::isfinite(slope)) return false;
    return Descend(gradient / -slope, step);
  }

 private:
  // Halves the step until the move is a permitted gain, then doubles it while that gains more.
  bool Descend(const Vec3d& direction, float& step) {
    for (int halving = 0; halving <= kMaxHalvings; ++halving) {
      LocalScore score;
      if (Accept(direction, step, judge_.score(), score)) {
        if (halving == 0 && step < kLargestStep) {
          LocalScore farther;
          if (Accept(direction, 2 * step, score, farther)) step *= 2;
        }
        return true;
      }
      if (step <= kSmallestStep) break;
      step /= 2;
    }
    return false;
  }

  bool Accept(const Vec3d& direction, float step, const LocalScore& to_beat, LocalScore& score) {
    const VertexConstraint& constraint = placement_.constraints.vertex[v_];
    Vec3d place = start_ + direction * step;
    if (constraint.kind != Constraint::kFree) {
      place =
          ConstrainFrom(constraint, place - offset_, foot_, placement_.features).point + offset_;
    }
    score = judge_.Try(place);
    if (!IsGain(to_beat, score, rules_.aim) || !judge_.Permits(score, rules_.floor)) return false;
    placement_.complex.vertices[v_] = place;
    return true;
  }

  Placement& placement_;
  const SweepRules& rules_;
  int32_t v_;
  MoveJudge judge_;
  Vec3d start_;
  Vec3d foot_;  // where the constraint admits the vertex, nearest to the start
  Vec3d offset_;
};

}  // namespace

absl::StatusOr<int64_t> SweepQuality(Placement& placement, const SweepRules& rules,
                                     SweepMemory& memory, const RunContext& run) {
  std::vector<uint8_t> moved(memory.active.size(), 0);
  const CellSurvey& survey = placement.survey;
  const auto is_needed = [&](int32_t v) {
    const auto cells = placement.neighbourhoods.cells[v];
    return std::any_of(cells.begin(), cells.end(),
                       [&](int32_t c) { return survey.min_scaled_jacobian[c] < rules.target; });
  };
  const absl::Status status = VisitByColour(placement.neighbourhoods, run, [&](int32_t v) {
    if (!memory.active[v]) return;
    const Constraint kind = placement.constraints.vertex[v].kind;
    if (kind == Constraint::kCorner || kind == Constraint::kFixed) return;
    if (!is_needed(v)) return;
    memory.step[v] = std::max(memory.step[v], kSmallestStep * 4);
    moved[v] = VertexSearch(placement, rules, survey.near_folding, v).Run(memory.step[v]);
  });
  if (!status.ok()) return status;
  std::fill(memory.active.begin(), memory.active.end(), 0);
  NoteMoves(moved, placement, memory);
  return std::count(moved.begin(), moved.end(), 1);
}

QualitySummary SummarizeQuality(const CellComplex& complex) {
  // Deterministic: fixed blocks, joined in a fixed order.
  QualitySummary summary = tbb::parallel_deterministic_reduce(
      tbb::blocked_range<size_t>(0, complex.cells.size(), kCellsPerBlock), QualitySummary{},
      [&](const tbb::blocked_range<size_t>& range, QualitySummary part) {
        for (size_t c = range.begin(); c < range.end(); ++c) {
          const double quality = CellQuality(complex.cells[c], complex.vertices);
          part.minimum = std::min(part.minimum, quality);
          part.average += quality;
          // CellQuality is the least scaled Jacobian where it is positive.
          const double jacobian =
              quality > 0 ? quality : ScaledJacobian(complex.cells[c], complex.vertices);
          part.min_scaled_jacobian = std::min(part.min_scaled_jacobian, jacobian);
          part.average_scaled_jacobian += jacobian;
        }
        return part;
      },
      [](const QualitySummary& a, const QualitySummary& b) {
        return QualitySummary{std::min(a.minimum, b.minimum), a.average + b.average,
                              std::min(a.min_scaled_jacobian, b.min_scaled_jacobian),
                              a.average_scaled_jacobian + b.average_scaled_jacobian};
      });
  const auto cell_count = static_cast<double>(complex.cells.size());
  if (cell_count > 0) summary.average /= cell_count;
  if (cell_count > 0) summary.average_scaled_jacobian /= cell_count;
  return summary;
}

}  // namespace amhex
