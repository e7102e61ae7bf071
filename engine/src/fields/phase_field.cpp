#include "fields/phase_field.h"

#include <cmath>

#include "base/array_view_of.h"
#include "base/stop_poll.h"
#include "fields/conjugate_gradient.h"
#include "fields/frame_lanes.h"
#include "fields/gradient_bodies.h"
#include "fields/node_links.h"
#include "fields/owned_node_order.h"
#include "fields/phase_seeds.h"

namespace amhex::fields {
namespace {

constexpr PhaseLanes kMinusImaginary = {1, -1, 1, -1, 1, -1, 1, -1};
constexpr PhaseLanes kMinusReal = {-1, 1, -1, 1, -1, 1, -1, 1};

// Complex numbers psi = exp(2 pi i phase), one per node and axis, stored as pairs of floats.
// Energy: sum over edges |psi_i e^{2 pi i increment} - psi_j|^2 (conjugated where the axes oppose)
// plus hull weight |psi - target|^2 plus pull |psi|^2. Nodes go by their numbers in the order.
class PhaseSystem {
 public:
  PhaseSystem(const OwnedNodeOrder& order, const PhaseDemands& demands, const RunContext& run)
      : links_(order.Links()),
        count_(links_.codes.size / 3),
        even_count_(order.View().even_count),
        run_(run) {
    turns_.resize(kTurns * count_);
    edge_count_.resize(count_);
    hull_weight_.assign(3 * count_, 0.0F);
    hull_target_.assign(6 * count_, 0.0F);
    ForEach(run, count_,
            TurnEdgesBody{links_, order.View(), demands.increments, WritableViewOf(turns_),
                          WritableViewOf(edge_count_)});
    ForEach(run, demands.hull.nodes.size,
            SpreadWishesBody{demands.hull, order.View(), WritableViewOf(hull_weight_),
                             WritableViewOf(hull_target_)});
  }

  int64_t odd_count() const { return count_ - even_count_; }

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

  // For the even nodes from `begin` to `end`.
  void Apply(int64_t begin, int64_t end, const float* from, float* to) const {
    ForEachInLanes(begin, end, [&](int64_t i) {
      StorePhases(OwnWeight(i) * LoadPhases(from + 6 * i) - SumOfNeighbours(i, from), to + 6 * i);
    });
  }

  // Sets the odd nodes from `begin` to `end`; a right side of null is zero.
  void Complete(int64_t begin, int64_t end, const float* right_side, float* x) const {
    ForEachInLanes(even_count_ + begin, even_count_ + end, [&](int64_t i) {
      PhaseLanes sum = SumOfNeighbours(i, x);
      if (right_side != nullptr) sum += LoadPhases(right_side + 6 * i);
      StorePhases(sum / OwnWeight(i), x + 6 * i);
    });
  }

  // The same one node at a time, on this system's arrays.
  PhaseOperator Matrix() const {
    return {links_, ArrayViewOf(turns_), ArrayViewOf(edge_count_), ArrayViewOf(hull_weight_),
            pull_,  even_count_};
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

  // Twice per axis; the lanes that are not used are not divided by zero.
  AMHEX_LANES_INLINE PhaseLanes OwnWeight(int64_t i) const {
    const AxisLanes weight =
        static_cast<float>(edge_count_[i]) + LoadAxes(hull_weight_.data() + 3 * i) + pull_;
    return __builtin_shufflevector(weight, weight, 0, 0, 1, 1, 2, 2, 3, 3);
  }

  // Of what they say that the numbers of node i are.
  AMHEX_LANES_INLINE PhaseLanes SumOfNeighbours(int64_t i, const float* from) const {
    PhaseLanes sum{};
    for (int d = 0; d < 3; ++d) {
      if (const int64_t j = links_.Ahead(i, d); j >= 0) {
        sum += FromForward(LoadPhases(from + 6 * j), i, d);
      }
      if (const int64_t j = links_.Behind(i, d); j >= 0) {
        sum += FromBackward(LoadPhases(from + 6 * j), j, d);
      }
    }
    return sum;
  }

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
  const int64_t count_, even_count_;
  const RunContext& run_;
  const std::array<LaneRotation, kRotationCount>& rotations_ = LaneRotations();
  std::vector<float> turns_;  // [node][d][axis] cosine, sine
  std::vector<uint8_t> edge_count_;
  std::vector<float> hull_weight_;  // [3 * node + axis]
  std::vector<float> hull_target_;  // weight times target
  float pull_ = kPlainPull;
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
  PhaseSolver(PhaseSystem& phases, const RunContext& run) : phases_(phases), run_(run) {}

  // All of `course`.
  absl::Status Solve(const PhaseCourse& course, std::vector<float>* x) {
    absl::Status status = Improve(phases_.hull_target(), course.first, x);
    if (!status.ok()) return status;
    try {
      SeedWeakPhases(phases_.Matrix(), StopPoll(run_), x);
    } catch (const RunStopped&) {
      return run_.CheckStop();
    }
    int32_t round = 0;
    for (const float pull : course.pulls) {
      course.on_round(round++);
      phases_.SetPull(pull);
      status = Improve(phases_.RightSide(*x), course.later, x);
      if (!status.ok()) return status;
    }
    return run_.CheckStop();
  }

 private:
  absl::Status Improve(const std::vector<float>& rhs, const SolveLimits& limits,
                       std::vector<float>* x) const {
    LinearSystem system;
    system.unknowns = PhaseOperator::kUnknowns;
    system.apply = [this](int /*pass*/, int64_t begin, int64_t end, const float* from,
                          float* product) { phases_.Apply(begin, end, from, product); };
    system.inverse_diagonal = [this] { return phases_.InverseDiagonal(); };
    system.completed_count = phases_.odd_count();
    system.complete = [this](int64_t begin, int64_t end, const float* right_side, float* of) {
      phases_.Complete(begin, end, right_side, of);
    };
    return SolveConjugateGradient(system, rhs, {limits.max_iterations, limits.tolerance}, run_, x)
        .status();
  }

  PhaseSystem& phases_;
  const RunContext& run_;
};

// What the hull wishes, with its arrays.
struct OwnedWishes {
  std::vector<float> weights, targets;
  HullWishes view;
};
OwnedWishes FindWishes(const HullNodes& at_hull, const BackgroundGrid& grid,
                       const LatticeForm& form, double weight, const RunContext& run) {
  OwnedWishes wishes;
  wishes.weights.resize(3 * at_hull.count()), wishes.targets.resize(6 * at_hull.count());
  ForEach(run, at_hull.count(),
          FindWishesBody{at_hull,
                         grid.Cells(),
                         ArrayViewOf(form.frames),
                         ArrayViewOf(form.sizes),
                         weight,
                         {wishes.weights.data(), 3 * at_hull.count()},
                         {wishes.targets.data(), 6 * at_hull.count()}});
  wishes.view = {at_hull.nodes, ArrayViewOf(wishes.weights), ArrayViewOf(wishes.targets)};
  return wishes;
}

}  // namespace

PhaseCourse CourseOf(const PhaseSettings& settings, const ProgressSlice& slice) {
  return {settings.hull_weight,
          {settings.first_iterations, settings.first_tolerance},
          {settings.round_iterations, settings.round_tolerance},
          Pulls(settings),
          [slice, rounds = settings.rounds](int32_t round) {
            slice.Report((round + 1.0) / (rounds + 2.0));
          }};
}

absl::StatusOr<std::vector<Vec3d>> SolvePhaseField(const BackgroundGrid& grid,
                                                   const ForwardCodes& codes,
                                                   const LatticeForm& form,
                                                   const PhaseSettings& settings,
                                                   const ProgressSlice& slice) {
  const RunContext& run = slice.run();
  const HullNodes at_hull = grid.fine().at_hull.View();
  std::vector<float> x;
  {
    const OwnedLinks links(grid.fine(), codes, run);
    const OwnedNodeOrder order(grid.Cells().keys, links.View(), run);
    const OwnedWishes wishes = FindWishes(at_hull, grid, form, settings.hull_weight, run);
    PhaseSystem phases(
        order, {{&form.increments.data()->data()->x, kIncrements * grid.count()}, wishes.view},
        run);
    std::vector<float> by_number(6 * grid.count(), 0.0F);
    const absl::Status status =
        PhaseSolver(phases, run).Solve(CourseOf(settings, slice), &by_number);
    if (!status.ok()) return status;
    x.resize(by_number.size());
    ForEach(run, grid.count(),
            OfNodesBody{order.View(), ArrayViewOf(by_number), WritableViewOf(x)});
  }
  std::vector<Vec3d> positions(grid.count());
  const ArrayView<Vec3d> places{positions.data(), grid.count()};
  ForEach(run, grid.count(),
          FindPositionBody{grid.Cells(), ArrayViewOf(form.steps), ArrayViewOf(x), places});
  ForEach(run, at_hull.count(),
          ProjectToLayersBody{at_hull, ArrayViewOf(form.frames), ArrayViewOf(form.sizes), places});
  if (absl::Status stopped = run.CheckStop(); !stopped.ok()) return stopped;
  slice.Report(1.0);
  return positions;
}

}  // namespace amhex::fields
