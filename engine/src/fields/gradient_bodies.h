// What the conjugate gradients of gradient_impl.h do per node, unknown or sum.
#pragma once

#include <cstdint>

#include "base/array_view.h"
#include "base/platform.h"
#include "base/sine_of_turns.h"
#include "fields/gradient_task.h"
#include "fields/node_order.h"
#include "fields/ordered_total.h"
#include "fields/phase_bodies.h"
#include "fields/sum_blocks.h"

namespace amhex::fields {

// Places in the array of counts; all but the last turn zero when the solve ends.
inline constexpr int kLiveUnknowns = 0;
inline constexpr int kLiveNodes = 1;
inline constexpr int kLiveOthers = 2;  // nodes that are not solved for
inline constexpr int kLiveSums = 3;    // interleaved partial sums
inline constexpr int kIsLive = 4;
inline constexpr int kIterationsDone = 5;
inline constexpr int kCountsSize = 6;
// Places in the array of numbers.
inline constexpr int kNorm = 0;
inline constexpr int kGoal = 1;
inline constexpr int kStep = 2;
inline constexpr int kCarry = 3;
inline constexpr int kNumbersSize = 4;

template <class Operator>
struct ApplyBody {
  Operator matrix;
  int pass = 0;
  ArrayView<const float> x;
  ArrayView<float> scratch;
  ArrayView<float> product;
  AMHEX_HD void operator()(int64_t node) const {
    matrix.Apply(pass, node, x.data, scratch.data, product.data);
  }
};

// Of a matrix that completes; one element per node that is not solved for.
template <class Operator>
struct CompleteBody {
  Operator matrix;
  ArrayView<const float> right_side;  // empty: zeros
  ArrayView<float> x;
  AMHEX_HD void operator()(int64_t i) const { matrix.Complete(i, right_side.data, x.data); }
};

// Terms of sums, in double precision.
struct ProductTerm {
  ArrayView<const float> a, b;
  AMHEX_HD double operator()(int64_t i) const {
    return static_cast<double>(a[i]) * static_cast<double>(b[i]);
  }
};
struct SquareTerm {
  ArrayView<const float> value, inverse_diagonal;
  AMHEX_HD double operator()(int64_t i) const {
    const double v = value[i];
    return v * v * static_cast<double>(inverse_diagonal[i]);
  }
};

// One of the interleaved sums of one block.
template <class Term>
struct PartialSumBody {
  int64_t count = 0;
  int64_t per_block = 0;  // terms
  Term term;
  ArrayView<double> partial;
  AMHEX_HD void operator()(int64_t index) const {
    const int64_t begin = index / kSumLanes * per_block, lane = index % kSumLanes;
    const int64_t end = Smaller(count, begin + per_block);
    const int64_t whole = begin + (end - begin) / kSumLanes * kSumLanes;
    double sum = 0;
    int64_t i = begin + lane;
#if defined(__CUDA_ARCH__)
    // Many terms at once are on their way from memory, which is what a device waits for here.
    constexpr int kAtOnce = 16;
    for (; i + (kAtOnce - 1) * kSumLanes < whole; i += kAtOnce * kSumLanes) {
      double terms[kAtOnce];
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k) terms[k] = term(i + k * kSumLanes);
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k) sum += terms[k];
    }
#endif
    for (; i < whole; i += kSumLanes) sum += term(i);
    for (i = whole; i < end && lane == 0; ++i) sum += term(i);
    partial[index] = sum;
  }
};

// What is decided once a sum is there (ordered_total.h).
struct DecideBody {
  ArrayView<const double> partial;
  ArrayView<int64_t> counts;
  ArrayView<double> numbers;

  AMHEX_HD int64_t block_count() const { return partial.size / kSumLanes; }
  AMHEX_HD double OfBlock(int64_t block) const {
    return SumOfLanes(partial.data + block * kSumLanes);
  }
  AMHEX_HD void End() const {
    for (int place = kLiveUnknowns; place <= kIsLive; ++place) counts[place] = 0;
  }
};
struct SetGoalBody : DecideBody {
  double tolerance = 0;
  AMHEX_HD void Decide(double total) const { numbers[kGoal] = tolerance * tolerance * total; }
};
struct BeginBody : DecideBody {
  AMHEX_HD void Decide(double norm) const {
    numbers[kNorm] = norm;
    if (!(norm > numbers[kGoal])) End();
  }
};
// Without curvature the direction has vanished: nothing is left to improve.
struct ChooseStepBody : DecideBody {
  AMHEX_HD void Decide(double curvature) const {
    if (!(curvature > 0)) return End();
    numbers[kStep] = numbers[kNorm] / curvature;
  }
};
struct ChooseCarryBody : DecideBody {
  AMHEX_HD void Decide(double norm) const {
    numbers[kCarry] = norm / numbers[kNorm];
    numbers[kNorm] = norm;
    ++counts[kIterationsDone];
    if (!(norm > numbers[kGoal])) End();
  }
};

// The vectors of the iteration; one element per unknown.
struct GradientVectors {
  ArrayView<const float> inverse_diagonal, right_side;
  ArrayView<float> x, residual, direction, product;
  ArrayView<const double> numbers;
};
struct StartBody {
  GradientVectors v;
  AMHEX_HD void operator()(int64_t i) const {
    v.residual[i] = v.right_side[i] - v.product[i];
    v.direction[i] = v.residual[i] * v.inverse_diagonal[i];
  }
};
struct MoveBody {
  GradientVectors v;
  AMHEX_HD void operator()(int64_t i) const {
    const auto step = static_cast<float>(v.numbers[kStep]);
    v.x[i] += step * v.direction[i];
    v.residual[i] -= step * v.product[i];
  }
};
struct TurnBody {
  GradientVectors v;
  AMHEX_HD void operator()(int64_t i) const {
    const auto carry = static_cast<float>(v.numbers[kCarry]);
    v.direction[i] = v.residual[i] * v.inverse_diagonal[i] + carry * v.direction[i];
  }
};

template <class Operator>
struct InvertDiagonalBody {
  Operator matrix;
  ArrayView<float> inverse_diagonal;
  AMHEX_HD void operator()(int64_t node) const {
    for (int unknown = 0; unknown < Operator::kUnknowns; ++unknown) {
      inverse_diagonal[Operator::Place(node, unknown)] = 1.0F / matrix.Diagonal(node, unknown);
    }
  }
};

// The turns of a PhaseOperator along the edges ahead, and how many edges there are. One element per
// number of the order.
struct TurnEdgesBody {
  NodeLinks links;  // in the order
  NodeOrder order;
  ArrayView<const float> increments;  // [node][d][axis]
  ArrayView<float> turns;             // [number][d][axis] cosine and sine
  ArrayView<uint8_t> edge_count;      // [number]
  AMHEX_HD void operator()(int64_t number) const {
    const float* const of_node = increments.data + int64_t{9} * order.node_of[number];
    int edges = 0;
    for (int d = 0; d < 3; ++d) {
      if (links.Behind(number, d) >= 0) ++edges;
      const bool is_edge = links.Ahead(number, d) >= 0;
      if (is_edge) ++edges;
      for (int a = 0; a < 3; ++a) {
        const int64_t at = PhaseOperator::Turn(number, d, a);
        const CosineAndSine turn = is_edge ? OfTurns(of_node[3 * d + a]) : CosineAndSine();
        turns[at] = static_cast<float>(turn.cosine);
        turns[at + 1] = static_cast<float>(turn.sine);
      }
    }
    edge_count[number] = static_cast<uint8_t>(edges);
  }
};

// Into arrays of all numbers of the order that are zero elsewhere.
struct SpreadWishesBody {
  HullWishes hull;
  NodeOrder order;
  ArrayView<float> weight;  // [number][axis]
  ArrayView<float> target;  // [unknown]
  AMHEX_HD void operator()(int64_t k) const {
    const int64_t number = order.number_of[hull.nodes[k]];
    for (int a = 0; a < 3; ++a) weight[3 * number + a] = hull.weights[3 * k + a];
    for (int u = 0; u < 6; ++u) target[6 * number + u] = hull.targets[6 * k + u];
  }
};

// What a solve has left before its first iteration.
struct BeginCountsBody {
  int64_t unknowns, nodes, others, sums;
  ArrayView<int64_t> counts;
  AMHEX_HD void operator()(int64_t /*index*/) const {
    counts[kLiveUnknowns] = unknowns, counts[kLiveNodes] = nodes, counts[kLiveOthers] = others;
    counts[kLiveSums] = sums, counts[kIsLive] = 1, counts[kIterationsDone] = 0;
  }
};

struct ClearBody {
  ArrayView<float> x;
  AMHEX_HD void operator()(int64_t i) const { x[i] = 0; }
};

}  // namespace amhex::fields
