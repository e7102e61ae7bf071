// The line search for a better place of one vertex; usable where bodies run.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "optimize/constrain.h"
#include "optimize/move_judge.h"

namespace amhex {

enum class QualityAim : uint8_t {
  kMinimum,  // lower the penalty that the worst corners dominate
  kAverage,  // raise the average of the cells' minima, with a penalty of EnergyKind::kMinima
};

struct SweepRules {
  QualityAim aim = QualityAim::kMinimum;
  double target = 0.5;  // only vertices with an incident cell below this are visited
  double floor = 0.5;   // no cell may fall below both this and its neighbourhood's old minimum
  CornerPenalty penalty = {};
};

// The directions in which the vertex may move, an orthonormal set.
struct FreeAxes {
  int count = 0;
  std::array<Vec3d, 3> axis;
};

AMHEX_HD inline FreeAxes AxesAt(const VertexConstraint& constraint, const ConstrainedPoint& at) {
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

inline constexpr float kSmallestStep = 0.002F;

// Line search along the falling energy.
class VertexSearch {
 public:
  // `room` as for LocalCells.
  AMHEX_HD VertexSearch(const PlacementView& placement, const SweepRules& rules, int32_t v,
                        LocalCell* room)
      : placement_(placement),
        rules_(rules),
        v_(v),
        judge_(placement, v, rules.penalty, FoldWatch::kSurvey, room) {}

  // Returns true if the vertex moved.
  AMHEX_HD bool Run(float& step) {
    const VertexConstraint& constraint = placement_.constraints[v_];
    start_ = placement_.vertices[v_];
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
  AMHEX_HD bool Descend(const Vec3d& direction, float& step) {
    constexpr float kLargestStep = 0.3F;
    constexpr int kMaxHalvings = 4;
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

  AMHEX_HD bool Accept(const Vec3d& direction, float step, const LocalScore& to_beat,
                       LocalScore& score) {
    const VertexConstraint& constraint = placement_.constraints[v_];
    Vec3d place = start_ + direction * step;
    if (constraint.kind != Constraint::kFree) {
      place =
          ConstrainFrom(constraint, place - offset_, foot_, placement_.features).point + offset_;
    }
    score = judge_.Try(place);
    if (!IsGain(to_beat, score) || !judge_.Permits(score, rules_.floor)) return false;
    placement_.vertices[v_] = place;
    return true;
  }

  AMHEX_HD bool IsGain(const LocalScore& before, const LocalScore& after) const {
    // Gains below these are not worth another sweep of the neighbourhood.
    constexpr double kMinRelativeEnergyGain = 1e-4;
    constexpr double kMinAverageGain = 1e-4;
    if (rules_.aim == QualityAim::kMinimum) {
      return after.energy < before.energy * (1 - kMinRelativeEnergyGain);
    }
    return after.energy < before.energy - kMinAverageGain;
  }

  const PlacementView& placement_;
  const SweepRules& rules_;
  int32_t v_;
  MoveJudge judge_;
  Vec3d start_;
  Vec3d foot_;  // where the constraint admits the vertex, nearest to the start
  Vec3d offset_;
};

// One sweep's visits of single vertices. What a sweep remembers: SweepMemory (placement.h).
struct SweepVisits {
  PlacementView placement;
  SweepRules rules;
  ArrayView<uint8_t> active;  // [vertex]
  ArrayView<float> step;      // [vertex]
  ArrayView<uint8_t> moved;   // out: [vertex]

  // Whether the vertex is worth a visit.
  AMHEX_HD bool Wants(int32_t v) const {
    const Constraint kind = placement.constraints[v].kind;
    if (active[v] == 0 || kind == Constraint::kCorner || kind == Constraint::kFixed) return false;
    const ArrayView<const int32_t> cells = placement.cells_at[v];
    for (int64_t k = 0; k < cells.size; ++k) {
      if (placement.min_scaled_jacobian[cells[k]] < rules.target) return true;
    }
    return false;
  }
  // `room` as for LocalCells.
  AMHEX_HD void Visit(int32_t v, LocalCell* room) const {
    step[v] = Larger(step[v], kSmallestStep * 4);
    moved[v] = VertexSearch(placement, rules, v, room).Run(step[v]) ? 1 : 0;
  }
};

}  // namespace amhex
