#include "fields/size_field.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "fields/conjugate_gradient.h"
#include "fields/half_lanes.h"
#include "fields/node_slots.h"

namespace amhex::fields {
namespace {

// A change of an axis' length along that axis is almost free: it costs this share.
constexpr double kAlongOwnAxis = 0.1;
// Fixes the common constant; small against the edge weights, whose sum is about nine.
constexpr float kRegularization = 1e-3F;

using Gradients = std::vector<std::array<Vec3f, 3>>;  // [node_count][axis]

Vec3f ToFloat(const Vec3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

// Axes of the neighbour's frame in the order and with the signs of the node's own.
AxisFrame RenamedFrame(const Quaternion& frame, const AxisRotation& rotation) {
  const AxisFrame own = ToFrame(frame);
  AxisFrame renamed;
  for (int k = 0; k < 3; ++k) renamed.axis[k] = own.axis[rotation.source[k]] * rotation.sign[k];
  return renamed;
}

// f_a x curl f_a by differences over the six axis neighbours, no longer than the limit.
std::array<Vec3f, 3> GradientsAt(const BackgroundGrid& grid, const std::vector<Quaternion>& frames,
                                 const ForwardCodes& codes, double limit, int64_t node) {
  const GridLevel& level = grid.fine();
  const AxisFrame frame = ToFrame(frames[node]);
  std::array<Vec3d, 3> curl;
  for (int d = 0; d < 3; ++d) {
    const int32_t next = level.neighbours[node][d];
    const int32_t previous = level.neighbours[node][Opposite(d)];
    if (next < 0 && previous < 0) continue;
    AxisFrame ahead = frame, behind = frame;
    if (next >= 0) ahead = RenamedFrame(frames[next], RotationFrom(level, codes, node, d));
    if (previous >= 0) {
      behind = RenamedFrame(frames[previous], RotationFrom(level, codes, node, Opposite(d)));
    }
    const double width = grid.spacing * ((next >= 0 ? 1 : 0) + (previous >= 0 ? 1 : 0));
    Vec3d unit;
    unit[d] = 1;
    for (int a = 0; a < 3; ++a) {
      curl[a] += Cross(unit, (ahead.axis[a] - behind.axis[a]) / width);
    }
  }
  std::array<Vec3f, 3> gradients;
  for (int a = 0; a < 3; ++a) {
    Vec3d gradient = Cross(frame.axis[a], curl[a]);
    const double length = Norm(gradient);
    if (length > limit) gradient *= limit / length;
    gradients[a] = ToFloat(gradient);
  }
  return gradients;
}

AMHEX_LANES_INLINE void ReorderLane(const std::array<int8_t, 3>& source, int lane,
                                    HalfLanesOfCube* v) {
  const Vec3f old = {v[0][lane], v[1][lane], v[2][lane]};
  for (int a = 0; a < 3; ++a) v[a][lane] = old[source[a]];
}

// The sum over the grid's axis edges of w (s_a(i) - s_b(j) + mean gradient . (x_j - x_i))^2, b the
// axis of j that a of i turns into. Axis edges only: with face diagonals the solve takes three
// times as long and the lattices fit worse, since those are the edges the lattice form closes
// later.
class SizeSystem {
 public:
  SizeSystem(const BackgroundGrid& grid, const std::vector<Quaternion>& frames,
             const ForwardCodes& codes, const RunContext& run)
      : level_(grid.fine()),
        codes_(codes),
        run_(run),
        slots_(level_, codes, run),
        spacing_(grid.spacing),
        weights_(SizeOperator::kWeights * slots_.count(), 0.0F) {
    ForEach(run, level_.count(), [&](int64_t i) { SetWeights(frames, i); });
  }

  int64_t slot_count() const { return slots_.count(); }
  int64_t even_count() const { return slots_.count() / 2; }
  int64_t Place(int64_t node, int axis) const { return SizeOperator::Place(NumberOf(node), axis); }

  // Four slots at a time, from even number `begin` to `end`.
  void Apply(int64_t begin, int64_t end, const float* x, float* product) const {
    RunWithWidestVectors([&] {
      for (int64_t cube = begin / kHalfSlots; cube < end / kHalfSlots; ++cube) {
        const Sums sums = SumsBeside<false>(cube, x);
        for (int a = 0; a < 3; ++a) {
          const int64_t at = kHalfSlots * (SizeOperator::kUnknowns * cube + a);
          StoreHalf(sums.weight[a] * LoadHalf(x + at) - sums.weighted[a], product + at);
        }
      }
    });
  }
  // The same, counted from the first odd one; a right side of null is zero.
  void Complete(int64_t begin, int64_t end, const float* right_side, float* x) const {
    RunWithWidestVectors([&] {
      for (int64_t cube = begin / kHalfSlots; cube < end / kHalfSlots; ++cube) {
        Sums sums = SumsBeside<true>(cube, x);
        for (int a = 0; a < 3; ++a) {
          const int64_t at = OfHalf(SizeOperator::kUnknowns, true) +
                             kHalfSlots * (SizeOperator::kUnknowns * cube + a);
          if (right_side != nullptr) sums.weighted[a] += LoadHalf(right_side + at);
          StoreHalf(sums.weighted[a] / sums.weight[a], x + at);
        }
      }
    });
  }

  // The same for a device, on this system's arrays.
  SizeOperator Matrix(const NodeLinks& links) const {
    return {links, {weights_.data(), static_cast<int64_t>(weights_.size())}, kRegularization};
  }
  SlotLinks Links() const { return {slots_, level_, codes_, run_}; }

  std::vector<float> InverseDiagonal() const {
    std::vector<float> inverse(SizeOperator::kUnknowns * slots_.count(), 1.0F);
    ForEach(run_, level_.count(), [&](int64_t i) {
      Vec3f diagonal = {kRegularization, kRegularization, kRegularization};
      VisitEdges(i, [&](int64_t, int a, int, float weight, int) { diagonal[a] += weight; });
      for (int a = 0; a < 3; ++a) inverse[Place(i, a)] = 1 / diagonal[a];
    });
    return inverse;
  }

  std::vector<float> RightSide(const Gradients& gradients) const {
    std::vector<float> rhs(SizeOperator::kUnknowns * slots_.count(), 0.0F);
    ForEach(run_, level_.count(), [&](int64_t i) {
      VisitEdges(i, [&](int64_t j, int a, int b, float weight, int k) {
        const int d = k % kForwardCount;
        const auto step = static_cast<float>(k == d ? spacing_ / 2 : -spacing_ / 2);
        rhs[Place(i, a)] -= weight * step * (gradients[i][a][d] + gradients[j][b][d]);
      });
    });
    return rhs;
  }

 private:
  // visit(neighbour, axis of i, axis of the neighbour, weight, neighbour index).
  template <class Visit>
  void VisitEdges(int64_t i, const Visit& visit) const {
    const std::array<int32_t, kNeighbourCount>& neighbours = level_.neighbours[i];
    for (int d = 0; d < 3; ++d) {
      if (const int64_t j = neighbours[d]; j >= 0) {
        const AxisRotation& rotation = kAxisRotations[codes_[i][d]];
        for (int a = 0; a < 3; ++a) visit(j, a, rotation.source[a], Weight(i, d, a), d);
      }
      if (const int64_t j = neighbours[Opposite(d)]; j >= 0) {
        const AxisRotation& rotation = kAxisRotations[codes_[j][d]];
        for (int b = 0; b < 3; ++b) {
          visit(j, rotation.source[b], b, Weight(j, d, b), Opposite(d));
        }
      }
    }
  }

  // By the axes of i. Both ends' weights, summed: the edge counts once from each side.
  void SetWeights(const std::vector<Quaternion>& frames, int64_t i) {
    const AxisFrame own = ToFrame(frames[i]);
    for (int d = 0; d < 3; ++d) {
      const int32_t j = level_.neighbours[i][d];
      if (j < 0) continue;
      const AxisFrame other = RenamedFrame(frames[j], kAxisRotations[codes_[i][d]]);
      for (int a = 0; a < 3; ++a) {
        const double c0 = own.axis[a][d], c1 = other.axis[a][d];
        weights_[WeightPlace(i, d, a)] =
            static_cast<float>(2 * (1 + kAlongOwnAxis) - c0 * c0 - c1 * c1);
      }
    }
  }

  int64_t NumberOf(int64_t node) const {
    return NumberOfSlot(slots_.SlotOf(node), slots_.count() / 2);
  }
  int64_t WeightPlace(int64_t node, int d, int axis) const {
    return PlaceInHalf(NumberOf(node), SizeOperator::kWeights, 3 * d + axis);
  }
  float Weight(int64_t node, int d, int axis) const { return weights_[WeightPlace(node, d, axis)]; }

  // Where the odd or even slots begin in an array of so many numbers per slot.
  int64_t OfHalf(int64_t per_slot, bool is_odd) const {
    return is_odd ? per_slot * even_count() : 0;
  }

  // By axis of the grid: what the slots ahead and behind have, and how much the edges weigh.
  struct Beside {
    HalfLanesOfCube ahead[3][3], behind[3][3], weight_behind[3][3];
  };
  template <int kAxis, bool kIsOdd>
  AMHEX_LANES_INLINE void TakeBeside(int64_t cube, const float* x, Beside& beside) const {
    constexpr int64_t kNumbers = kHalfSlots * SizeOperator::kUnknowns;
    constexpr int64_t kWeights = kHalfSlots * SizeOperator::kWeights;
    const float* others = x + OfHalf(SizeOperator::kUnknowns, !kIsOdd);
    const float* weights = weights_.data() + OfHalf(SizeOperator::kWeights, !kIsOdd);
    const float* next = slots_.Beside(NodeSlots::Side::kAhead, kAxis, cube, others, kNumbers);
    const float* previous = slots_.Beside(NodeSlots::Side::kBehind, kAxis, cube, others, kNumbers);
    const float* weights_behind =
        slots_.Beside(NodeSlots::Side::kBehind, kAxis, cube, weights, kWeights);
    for (int a = 0; a < 3; ++a) {
      const int64_t at = kHalfSlots * a, weights_at = kHalfSlots * (3 * kAxis + a);
      const HalfLanesOfCube numbers = LoadHalf(others + kNumbers * cube + at);
      beside.ahead[kAxis][a] = HalfAhead<kAxis, kIsOdd>(numbers, LoadHalf(next + at));
      beside.behind[kAxis][a] = HalfBehind<kAxis, kIsOdd>(numbers, LoadHalf(previous + at));
      beside.weight_behind[kAxis][a] = HalfBehind<kAxis, kIsOdd>(
          LoadHalf(weights + kWeights * cube + weights_at), LoadHalf(weights_behind + weights_at));
    }
  }
  // Renames the axes of those of the cube's slots that are odd or even as asked.
  template <bool kIsOdd>
  AMHEX_LANES_INLINE void Rename(int64_t cube, Beside& beside) const {
    for (const NodeSlots::RenamedEdge& edge : slots_.Renamed(cube, NodeSlots::Side::kAhead)) {
      if ((IsOddLane(edge.lane) != 0) != kIsOdd) continue;
      ReorderLane(kAxisRotations[edge.code].source, edge.lane / 2, beside.ahead[edge.axis]);
    }
    for (const NodeSlots::RenamedEdge& edge : slots_.Renamed(cube, NodeSlots::Side::kBehind)) {
      if ((IsOddLane(edge.lane) != 0) != kIsOdd) continue;
      const std::array<int8_t, 3>& source = kAxisRotations[kInverseCodes[edge.code]].source;
      ReorderLane(source, edge.lane / 2, beside.behind[edge.axis]);
      ReorderLane(source, edge.lane / 2, beside.weight_behind[edge.axis]);
    }
  }

  // As SizeOperator's, by axis.
  struct Sums {
    HalfLanesOfCube weight[3], weighted[3];
  };
  template <bool kIsOdd>
  AMHEX_LANES_INLINE Sums SumsBeside(int64_t cube, const float* x) const {
    Beside beside;
    TakeBeside<0, kIsOdd>(cube, x, beside);
    TakeBeside<1, kIsOdd>(cube, x, beside);
    TakeBeside<2, kIsOdd>(cube, x, beside);
    Rename<kIsOdd>(cube, beside);
    const float* weights = weights_.data() + OfHalf(SizeOperator::kWeights, kIsOdd) +
                           kHalfSlots * SizeOperator::kWeights * cube;
    Sums sums;
    for (int a = 0; a < 3; ++a) {
      constexpr HalfLanesOfCube kOne = {1, 1, 1, 1};
      sums.weight[a] = kOne * kRegularization;
      sums.weighted[a] = HalfLanesOfCube{};
      for (int d = 0; d < 3; ++d) {
        const HalfLanesOfCube ahead = LoadHalf(weights + kHalfSlots * (3 * d + a));
        sums.weight[a] += ahead;
        sums.weighted[a] += ahead * beside.ahead[d][a];
        sums.weight[a] += beside.weight_behind[d][a];
        sums.weighted[a] += beside.weight_behind[d][a] * beside.behind[d][a];
      }
    }
    return sums;
  }

  const GridLevel& level_;
  const ForwardCodes& codes_;
  const RunContext& run_;
  const NodeSlots slots_;
  double spacing_;
  std::vector<float> weights_;  // by number [d][axis]; zero without an edge
};

// Lengths from logarithms: centred, clamped, then rescaled so that cells keep their mean volume.
std::vector<Vec3d> LengthsFromLogarithms(const std::vector<float>& s, const SizeSettings& settings,
                                         const RunContext& run) {
  const auto count = static_cast<int64_t>(s.size() / 3);
  const double total =
      DeterministicSum(run, static_cast<int64_t>(s.size()), [&](int64_t begin, int64_t end) {
        double sum = 0;
        for (int64_t i = begin; i < end; ++i) sum += s[i];
        return sum;
      });
  const double mean = total / static_cast<double>(s.size());
  const double low = std::log(settings.min_size), high = std::log(settings.max_size);
  std::vector<Vec3d> sizes(count);
  const double density = DeterministicSum(run, count, [&](int64_t begin, int64_t end) {
    double sum = 0;
    for (int64_t i = begin; i < end; ++i) {
      for (int a = 0; a < 3; ++a) {
        sizes[i][a] = std::exp(std::clamp(s[3 * i + a] - mean, low, high));
      }
      sum += 1 / (sizes[i].x * sizes[i].y * sizes[i].z);
    }
    return sum;
  });
  const double scale = std::cbrt(density / static_cast<double>(count));
  ForEach(run, count, [&](int64_t i) { sizes[i] *= scale; });
  return sizes;
}

}  // namespace

absl::StatusOr<std::vector<Vec3d>> SolveSizeField(const BackgroundGrid& grid,
                                                  const std::vector<Quaternion>& frames,
                                                  const ForwardCodes& codes,
                                                  const SizeSettings& settings,
                                                  const ProgressSlice& slice) {
  const RunContext& run = slice.run();
  const SizeSystem system(grid, frames, codes, run);
  std::vector<float> rhs;
  {
    Gradients gradients(grid.count());
    ForEach(run, grid.count(), [&](int64_t i) {
      gradients[i] = GradientsAt(grid, frames, codes, settings.gradient_limit, i);
    });
    rhs = system.RightSide(gradients);
  }
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  slice.Report(0.3);
  LinearSystem linear;
  linear.unknowns = SizeOperator::kUnknowns;
  linear.apply = [&](int /*pass*/, int64_t begin, int64_t end, const float* x, float* product) {
    system.Apply(begin, end, x, product);
  };
  linear.inverse_diagonal = [&system] { return system.InverseDiagonal(); };
  linear.completed_count = system.slot_count() - system.even_count();
  linear.complete = [&](int64_t begin, int64_t end, const float* right_side, float* of) {
    system.Complete(begin, end, right_side, of);
  };
  std::optional<SlotLinks> links;
  if (settings.device != nullptr) {
    linear.device = settings.device;
    if (settings.links != nullptr) linear.links = &settings.links->of_slots;
    linear.matrix = system.Matrix(links.emplace(system.Links()).View());
  }
  std::vector<float> x;
  const absl::StatusOr<int> iterations =
      SolveConjugateGradient(linear, rhs, {settings.max_iterations, settings.tolerance}, run, &x);
  if (!iterations.ok()) return iterations.status();
  std::vector<float> s(3 * grid.count());
  ForEach(run, grid.count(), [&](int64_t i) {
    for (int a = 0; a < 3; ++a) s[3 * i + a] = x[system.Place(i, a)];
  });
  std::vector<Vec3d> sizes = LengthsFromLogarithms(s, settings, run);
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  slice.Report(1.0);
  return sizes;
}

}  // namespace amhex::fields
