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
  double least_gain = 5e-5;  // kAverage: a move that lowers the energy by less is not made
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

// The point of the axes where the model is least, from where it was made; zero if there is none.
AMHEX_HD inline Vec3d LowestPoint(const EnergyModel& model, const FreeAxes& axes) {
  // Added to the diagonal, a share of its mean: directions in which nothing curves.
  constexpr double kRidge = 1e-4;
  std::array<double, 3> fall{};              // -gradient, then the solution
  std::array<std::array<double, 3>, 3> m{};  // the Hessian, then its Cholesky factor
  double trace = 0;
  for (int a = 0; a < axes.count; ++a) {
    fall[a] = -Dot(axes.axis[a], model.gradient);
    const Vec3d row{Dot(axes.axis[a], model.hessian[0]), Dot(axes.axis[a], model.hessian[1]),
                    Dot(axes.axis[a], model.hessian[2])};
    for (int b = 0; b <= a; ++b) m[a][b] = Dot(row, axes.axis[b]);
    trace += m[a][a];
  }
  for (int a = 0; a < axes.count; ++a) {
    m[a][a] += kRidge * trace;
    for (int b = 0; b <= a; ++b) {
      double sum = m[a][b];
      for (int k = 0; k < b; ++k) sum -= m[a][k] * m[b][k];
      if (a == b) {
        if (!(sum > 0)) return {};
        m[a][a] = std::sqrt(sum);
      } else {
        m[a][b] = sum / m[b][b];
      }
    }
  }
  for (int a = 0; a < axes.count; ++a) {
    for (int k = 0; k < a; ++k) fall[a] -= m[a][k] * fall[k];
    fall[a] /= m[a][a];
  }
  Vec3d point;
  for (int a = axes.count - 1; a >= 0; --a) {
    for (int k = a + 1; k < axes.count; ++k) fall[a] -= m[k][a] * fall[k];
    fall[a] /= m[a][a];
    point += axes.axis[a] * fall[a];
  }
  return point;
}

inline constexpr float kSmallestStep = 0.002F;
// Steps go so much farther than the least point of the model, as in successive over-relaxation:
// one vertex after the other follows slowly what all around it have yet to do. From 1.4 to 1.8 do
// about the same for averages, but the minimum of few cells suffers from 1.5 on.
inline constexpr float kOverRelaxation = 1.4F;

// Newton steps of the energy, shortened until they are a permitted gain. Cells as for MoveJudge.
template <class Cells>
class VertexSearch {
 public:
  // `room` as for LocalCells.
  AMHEX_HD VertexSearch(const PlacementView& placement, const SweepRules& rules, int32_t v,
                        LocalCell* room)
      : placement_(placement),
        rules_(rules),
        v_(v),
        judge_(placement, v, rules.penalty, FoldWatch::kSurvey, room) {}

  // Returns true if the vertex moved. `step` is how far it may move, remembered between visits.
  AMHEX_HD bool Run(float& step) {
    const VertexConstraint& constraint = placement_.constraints[v_];
    start_ = placement_.vertices[v_];
    const ConstrainedPoint at = FindFoot(placement_, v_);
    // A vertex that has not reached the hull keeps its offset while it slides.
    foot_ = at.point;
    offset_ = start_ - foot_;
    const FreeAxes axes = AxesAt(constraint, at);
    if (axes.count == 0) return false;
    const EnergyModel model = judge_.cells().Model();
    const Vec3d move = LowestPoint(model, axes);
    const double length = Norm(move);
    if (!(length > 0) || !std::isfinite(length)) return false;
    // To first order the energy falls by so much; it curves upwards.
    if (-Dot(move, model.gradient) < WorthwhileGain(judge_.score())) return false;
    return Descend(move / length, static_cast<float>(length), step);
  }

 private:
  // Halves the step until the move is a permitted gain.
  AMHEX_HD bool Descend(const Vec3d& direction, float length, float& step) {
    constexpr float kLargestStep = 0.3F;
    constexpr int kMaxHalvings = 4;
    float tried = Smaller(kOverRelaxation * length, step);
    for (int halving = 0; halving <= kMaxHalvings; ++halving) {
      if (Accept(direction, tried)) {
        step = halving == 0 ? Larger(step, Smaller(2 * tried, kLargestStep)) : tried;
        return true;
      }
      if (tried <= kSmallestStep) break;
      tried /= 2;
    }
    step = tried;
    return false;
  }

  AMHEX_HD bool Accept(const Vec3d& direction, float step) {
    const VertexConstraint& constraint = placement_.constraints[v_];
    Vec3d place = start_ + direction * step;
    if (constraint.kind != Constraint::kFree) {
      place =
          ConstrainFrom(constraint, place - offset_, foot_, placement_.features).point + offset_;
    }
    const LocalScore score = judge_.Try(place);
    const LocalScore& before = judge_.score();
    if (!(score.energy < before.energy - WorthwhileGain(before))) return false;
    if (!judge_.Permits(score, rules_.floor)) return false;
    placement_.vertices[v_] = place;
    return true;
  }

  // Less is not worth another sweep of the neighbourhood.
  AMHEX_HD double WorthwhileGain(const LocalScore& before) const {
    constexpr double kRelativeEnergyGain = 1e-4;
    return rules_.aim == QualityAim::kMinimum ? before.energy * kRelativeEnergyGain
                                              : rules_.least_gain;
  }

  const PlacementView& placement_;
  const SweepRules& rules_;
  int32_t v_;
  MoveJudge<Cells> judge_;
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
  // `room` as for LocalCells; Cells as for MoveJudge.
  template <class Cells>
  AMHEX_HD void Visit(int32_t v, LocalCell* room) const {
    float farthest = Larger(step[v], kSmallestStep * 4);
    moved[v] = VertexSearch<Cells>(placement, rules, v, room).Run(farthest) ? 1 : 0;
    step[v] = farthest;
  }
};

}  // namespace amhex
