#include "fields/phase_field.h"

#include <cmath>
#include <numbers>

#include "base/arc_tangent.h"
#include "base/sine_of_turns.h"
#include "base/stop_poll.h"
#include "cuda/device_use.h"
#include "fields/conjugate_gradient.h"
#include "fields/frame_lanes.h"
#include "fields/gradient_bodies.h"
#include "fields/gradient_task.h"
#include "fields/node_links.h"
#include "fields/phase_seeds.h"

namespace amhex::fields {
namespace {

constexpr double kFullTurn = 2 * std::numbers::pi;
// Fixes what no hull fixes in the plain solve.
constexpr float kRegularization = 1e-4F;
// Rounds over a node's hull constraints when it has several: they are not quite orthogonal.
constexpr int kProjectionRounds = 3;
constexpr PhaseLanes kMinusImaginary = {1, -1, 1, -1, 1, -1, 1, -1};
constexpr PhaseLanes kMinusReal = {-1, 1, -1, 1, -1, 1, -1, 1};

template <class T>
ArrayView<const T> ViewOf(const std::vector<T>& values) {
  return {values.data(), static_cast<int64_t>(values.size())};
}

// Owns what the solves are made of, but for the form's increments.
struct OwnedDemands {
  const Increments& increments;
  std::vector<int32_t> nodes;
  std::vector<float> weights, targets;
  PhaseDemands View() const {
    return {{&increments.data()->data()->x, 9 * static_cast<int64_t>(increments.size())},
            {ViewOf(nodes), ViewOf(weights), ViewOf(targets)}};
  }
};

// "Centres half a cell below the hull", of the k-th node that is next to it.
void SetWishes(const BackgroundGrid& grid, const LatticeForm& form, double weight, int32_t k,
               OwnedDemands* demands) {
  const int32_t i = demands->nodes[k];
  const AxisFrame frame = ToFrame(form.frames[i]);
  for (const HullConstraint& c : grid.fine().constraints[k]) {
    const NearestAxis nearest = FindNearestAxis(frame, c.normal);
    if (nearest.cosine <= kAlignedCosine) continue;
    const double size = form.sizes[i][nearest.axis];
    // Way along the axis from the node to the layer of centres below the hull.
    const double way = nearest.sign * (Dot(c.normal, c.point - grid.Position(i)) - size / 2);
    const CosineAndSine target = OfTurns(-way / size);
    const int u = 3 * k + nearest.axis;
    demands->weights[u] += static_cast<float>(weight);
    demands->targets[2 * u] += static_cast<float>(weight * target.cosine);
    demands->targets[2 * u + 1] += static_cast<float>(weight * target.sine);
  }
}

OwnedDemands FindDemands(const BackgroundGrid& grid, const LatticeForm& form, double weight,
                         const RunContext& run) {
  const size_t at_hull = grid.fine().constraints.size();
  OwnedDemands demands{form.increments, std::vector<int32_t>(at_hull),
                       std::vector<float>(3 * at_hull, 0.0F),
                       std::vector<float>(6 * at_hull, 0.0F)};
  ForEach(run, grid.count(), [&](int64_t i) {
    const int32_t k = grid.fine().constraint_of_node[i];
    if (k < 0) return;
    demands.nodes[k] = static_cast<int32_t>(i);
    SetWishes(grid, form, weight, k, &demands);
  });
  return demands;
}

// Complex numbers psi = exp(2 pi i phase), one per node and axis, stored as pairs of floats.
// Energy: sum over edges |psi_i e^{2 pi i increment} - psi_j|^2 (conjugated where the axes oppose)
// plus hull weight |psi - target|^2 plus pull |psi|^2.
class PhaseSystem {
 public:
  PhaseSystem(const NodeLinks& links, const PhaseDemands& demands, const RunContext& run)
      : links_(links), count_(links.codes.size / 3), run_(run) {
    turns_.resize(kTurns * (count_ + 1));  // the last is read beyond its end
    edge_count_.resize(count_);
    hull_weight_.assign(3 * count_, 0.0F);
    hull_target_.assign(6 * count_, 0.0F);
    ForEach(run, count_,
            TurnEdgesBody{links,
                          demands.increments,
                          {turns_.data(), kTurns * count_},
                          {edge_count_.data(), count_}});
    ForEach(
        run, demands.hull.nodes.size,
        SpreadWishesBody{
            demands.hull, {hull_weight_.data(), 3 * count_}, {hull_target_.data(), 6 * count_}});
  }

  void SetPull(float pull) { pull_ = pull; }

  std::vector<float> InverseDiagonal() const {
    std::vector<float> inverse(6 * count_);
    ForEach(run_, count_, [&](int64_t i) {
      for (int a = 0; a < 3; ++a) {
        const float value =
            1.0F / (static_cast<float>(edge_count_[i]) + hull_weight_[3 * i + a] + pull_);
        inverse[2 * (3 * i + a)] = inverse[2 * (3 * i + a) + 1] = value;
      }
    });
    return inverse;
  }

  // For the nodes from `begin` to `end`.
  void Apply(int64_t begin, int64_t end, const float* from, float* to) const {
    ForEachInLanes(begin, end, [&](int64_t i) {
      const AxisLanes weight =
          static_cast<float>(edge_count_[i]) + LoadAxes(hull_weight_.data() + 3 * i) + pull_;
      PhaseLanes sum = __builtin_shufflevector(weight, weight, 0, 0, 1, 1, 2, 2, 3, 3) *
                       LoadPhases(from + 6 * i);
      for (int d = 0; d < 3; ++d) {
        if (const int64_t j = links_.Ahead(i, d); j >= 0) {
          sum -= FromForward(LoadPhases(from + 6 * j), i, d);
        }
        if (const int64_t j = links_.Behind(i, d); j >= 0) {
          sum -= FromBackward(LoadPhases(from + 6 * j), j, d);
        }
      }
      StorePhases(sum, to + 6 * i);
    });
  }

  // The same one node at a time, on this system's arrays.
  PhaseOperator Matrix() const {
    return {
        links_, {turns_.data(), kTurns * count_}, ViewOf(edge_count_), ViewOf(hull_weight_), pull_};
  }

  // Hull targets, plus the pull towards the unit numbers in the direction of x.
  std::vector<float> RightSide(const std::vector<float>& x) const {
    const int64_t count = 6 * count_;
    std::vector<float> rhs(count);
    ForEach(run_, count / 2,
            PullBody{{hull_target_.data(), count}, {x.data(), count}, pull_, {rhs.data(), count}});
    return rhs;
  }
  const std::vector<float>& hull_target() const { return hull_target_; }

 private:
  static constexpr int64_t kTurns = 18;  // numbers per node

  // psi times e^{i turn}, or e^{-i turn} with the opposite signs.
  AMHEX_LANES_INLINE static PhaseLanes Turned(const PhaseLanes& psi, const float* turns,
                                              const PhaseLanes& sine_sign) {
    const PhaseLanes turn = LoadPhases(turns);
    const PhaseLanes cosine = __builtin_shufflevector(turn, turn, 0, 0, 2, 2, 4, 4, 6, 6);
    const PhaseLanes sine = __builtin_shufflevector(turn, turn, 1, 1, 3, 3, 5, 5, 7, 7);
    const PhaseLanes swapped = __builtin_shufflevector(psi, psi, 1, 0, 3, 2, 5, 4, 7, 6);
    return psi * cosine + swapped * (sine * sine_sign);
  }

  // Neighbour i + d, seen from i: e^{-i turn} times psi_j, conjugated where the axes oppose.
  AMHEX_LANES_INLINE PhaseLanes FromForward(const PhaseLanes& psi_j, int64_t i, int d) const {
    const float* turns = TurnsAlong(i, d);
    const uint8_t code = links_.codes[3 * i + d];
    if (code == 0) return Turned(psi_j, turns, kMinusImaginary);
    const LaneRotation& rotation = rotations_[code];
    return Turned(rotation.conjugation * Shuffled(psi_j, rotation.phase_source), turns,
                  kMinusImaginary);
  }

  // Neighbour j = i - d, whose axis a turns into axis rotation.source[a] of i.
  AMHEX_LANES_INLINE PhaseLanes FromBackward(const PhaseLanes& psi_j, int64_t j, int d) const {
    const PhaseLanes turned = Turned(psi_j, TurnsAlong(j, d), kMinusReal);
    const uint8_t code = links_.codes[3 * j + d];
    if (code == 0) return turned;
    const LaneRotation& rotation = rotations_[code];
    return Shuffled(rotation.conjugation * turned, rotation.phase_inverse);
  }

  AMHEX_LANES_INLINE const float* TurnsAlong(int64_t i, int d) const {
    return turns_.data() + PhaseOperator::Turn(i, d, 0);
  }

  const NodeLinks links_;
  const int64_t count_;
  const RunContext& run_;
  const std::array<LaneRotation, kRotationCount>& rotations_ = LaneRotations();
  std::vector<float> turns_;  // [node][d][axis] cosine, sine; and room for a load
  std::vector<uint8_t> edge_count_;
  std::vector<float> hull_weight_;  // [3 * node + axis]
  std::vector<float> hull_target_;  // weight times target
  float pull_ = kRegularization;
};

// What the pull is in each round.
std::vector<float> Pulls(const PhaseSettings& settings) {
  std::vector<float> pulls;
  for (int round = 0; round < settings.rounds; ++round) {
    const double progress =
        settings.rounds > 1 ? static_cast<double>(round) / (settings.rounds - 1) : 1.0;
    pulls.push_back(static_cast<float>(
        settings.first_pull * std::pow(settings.last_pull / settings.first_pull, progress)));
  }
  return pulls;
}

class PhaseSolver {
 public:
  PhaseSolver(const CellCentres& cells, const NodeLinks& links, const PhaseSettings& settings,
              const RunContext& run)
      : cells_(cells), links_(links), settings_(settings), run_(run) {}

  // All of `course`, where the settings say.
  absl::Status Solve(const PhaseCourse& course, std::vector<float>* x) {
    const auto on_cpu = [&]() -> absl::StatusOr<bool> {
      PhaseSystem phases(links_, course.demands, run_);
      const absl::Status status = SolveOnCpu(course, phases, x);
      return status.ok() ? absl::StatusOr<bool>(true) : status;
    };
    GradientTask task;
    task.matrix = PhaseOperator{links_, {}, {}, {}, kRegularization};
    if (settings_.links != nullptr) task.links = &settings_.links->of_nodes;
    task.cells = cells_;
    task.node_count = static_cast<int64_t>(x->size()) / PhaseOperator::kUnknowns;
    task.course = &course;
    task.x = x;
    task.limits = {settings_.round_iterations, settings_.round_tolerance};
    task.should_stop = [this] { return run_.ShouldStop(); };
    const absl::Status status = RunWhereChosen(settings_.device, &task, on_cpu).status();
    return status.ok() ? run_.CheckStop() : status;
  }

 private:
  absl::Status SolveOnCpu(const PhaseCourse& course, PhaseSystem& phases, std::vector<float>* x) {
    absl::Status status = Improve(phases, phases.hull_target(), course.first, x);
    if (!status.ok()) return status;
    try {
      SeedWeakPhases(phases.Matrix(), StopPoll(run_), x);
    } catch (const RunStopped&) {
      return run_.CheckStop();
    }
    int32_t round = 0;
    for (const float pull : course.pulls) {
      course.on_round(round++);
      phases.SetPull(pull);
      status = Improve(phases, phases.RightSide(*x),
                       {settings_.round_iterations, settings_.round_tolerance}, x);
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  absl::Status Improve(const PhaseSystem& phases, const std::vector<float>& rhs,
                       const SolveLimits& limits, std::vector<float>* x) const {
    LinearSystem system;
    system.unknowns = PhaseOperator::kUnknowns;
    system.apply = [&phases](int /*pass*/, int64_t begin, int64_t end, const float* from,
                             float* product) { phases.Apply(begin, end, from, product); };
    system.inverse_diagonal = [&phases] { return phases.InverseDiagonal(); };
    return SolveConjugateGradient(system, rhs, {limits.max_iterations, limits.tolerance}, run_, x)
        .status();
  }

  const CellCentres cells_;
  const NodeLinks links_;
  const PhaseSettings& settings_;
  const RunContext& run_;
};

// Onto the layer of cell centres that is nearest along each aligned hull normal.
void ProjectToLayers(const HullConstraints& constraints, const AxisFrame& frame, const Vec3d& size,
                     Vec3d* position) {
  const int rounds = constraints.count > 1 ? kProjectionRounds : 1;
  for (int round = 0; round < rounds; ++round) {
    for (const HullConstraint& c : constraints) {
      const NearestAxis nearest = FindNearestAxis(frame, c.normal);
      if (nearest.cosine <= kAlignedCosine) continue;
      const double height = size[nearest.axis];
      const double off = Dot(c.normal, *position - c.point) + height / 2;
      *position -= c.normal * (off - height * std::round(off / height));
    }
  }
}

}  // namespace

absl::StatusOr<std::vector<Vec3d>> SolvePhaseField(const BackgroundGrid& grid,
                                                   const ForwardCodes& codes,
                                                   const LatticeForm& form,
                                                   const PhaseSettings& settings,
                                                   const ProgressSlice& slice) {
  const RunContext& run = slice.run();
  const OwnedLinks links(grid.fine(), codes, run);
  const OwnedDemands demands = FindDemands(grid, form, settings.hull_weight, run);
  std::vector<float> x(6 * grid.count(), 0.0F);
  const PhaseCourse course{
      demands.View(),
      {settings.first_iterations, settings.first_tolerance},
      Pulls(settings),
      [&](int32_t round) { slice.Report((round + 1.0) / (settings.rounds + 2.0)); }};
  if (absl::Status status =
          PhaseSolver(grid.Cells(), links.View(), settings, run).Solve(course, &x);
      !status.ok()) {
    return status;
  }
  std::vector<Vec3d> positions(grid.count());
  ForEach(run, grid.count(), [&](int64_t i) {
    Vec3d p = grid.Position(i);
    for (int a = 0; a < 3; ++a) {
      const double phase = ArcTangent2(x[2 * (3 * i + a) + 1], x[2 * (3 * i + a)]) / kFullTurn;
      p -= form.steps[i][a] * phase;
    }
    if (const HullConstraints* constraints = grid.fine().ConstraintsOf(i)) {
      ProjectToLayers(*constraints, ToFrame(form.frames[i]), form.sizes[i], &p);
    }
    positions[i] = p;
  });
  if (absl::Status stopped = run.CheckStop(); !stopped.ok()) return stopped;
  slice.Report(1.0);
  return positions;
}

}  // namespace amhex::fields
