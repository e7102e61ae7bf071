// Conjugate gradients (conjugate_gradient.h) as a template over the executor and the matrix. The
// numbers that decide how it goes on stay where bodies run; the bits are those of the host's
// solver.
#pragma once

#include <cstdint>
#include <utility>

#include "exec/executor.h"
#include "fields/gradient_bodies.h"
#include "fields/gradient_task.h"
#include "fields/ordered_total.h"
#include "fields/sum_blocks.h"

namespace amhex::fields {

// Of one solve, or of solves in a row.
template <class E, class Operator>
class GradientLoop {
 public:
  GradientLoop(E& executor, int64_t node_count)
      : executor_(executor),
        node_count_(node_count),
        unknowns_(node_count * Operator::kUnknowns),
        scratch_(executor.template Alloc<float>(node_count * Operator::kScratch)),
        partial_(executor.template Alloc<double>(Sums(node_count))),
        numbers_(executor.template Alloc<double>(kNumbersSize)),
        counts_(executor.template Alloc<int64_t>(kCountsSize)),
        inverse_diagonal_(executor.template Alloc<float>(unknowns_)) {
    x = Zeros(unknowns_);
  }

  // Memory where bodies run, with x and the right side, but for the matrix.
  static int64_t Bytes(int64_t node_count) {
    constexpr int64_t kVectors = 4;  // right side, diagonal, x, direction
    // Residual and product; half of all nodes are solved for where the others follow, nearly.
    constexpr int64_t kOfSolved = Operator::kCompletes ? 1 : 2;
    return node_count * ((kVectors + kOfSolved) * Operator::kUnknowns + Operator::kScratch) *
               static_cast<int64_t>(sizeof(float)) +
           Sums(node_count) * static_cast<int64_t>(sizeof(double));
  }

  // To be set before a solve. What x is, is where it starts.
  Operator matrix;
  Buffer<E, float> right_side, x;

  // Of all nodes.
  int64_t unknowns() const { return unknowns_; }
  // Of the last solve.
  const Buffer<E, int64_t>& counts() const { return counts_; }

  Buffer<E, float> Zeros(int64_t count) {
    Buffer<E, float> zeros = executor_.template Alloc<float>(count);
    executor_.ForEach("start at zero", count, ClearBody{zeros.View()});
    return zeros;
  }

  // Once before the first solve, when the matrix is known, and after Rest.
  void Prepare() {
    solved_nodes_ = matrix.solved_count(node_count_);
    residual_ = executor_.template Alloc<float>(SolvedUnknowns());
    direction_ = executor_.template Alloc<float>(unknowns_);
    product_ = executor_.template Alloc<float>(SolvedUnknowns());
  }
  // Until then others have the room.
  void Rest() { residual_ = {}, direction_ = {}, product_ = {}; }

  void Solve(const SolveLimits& limits) {
    executor_.ForEach("begin to count", 1,
                      BeginCountsBody{SolvedUnknowns(), solved_nodes_, node_count_ - solved_nodes_,
                                      Sums(solved_nodes_), counts_.View()});
    SetDiagonal();
    Start(limits.tolerance);
    executor_.Repeat(
        limits.max_iterations, counts_, [this] { Iterate(); },
        [](const int64_t* counts) { return counts[kIsLive] == 0; });
    if constexpr (Operator::kCompletes) {
      executor_.ForEach("complete the solution", node_count_ - solved_nodes_,
                        CompleteBody<Operator>{matrix, ReadOnly(right_side.View()), x.View()});
    }
  }

 private:
  template <class T>
  using Array = Buffer<E, T>;

  static int64_t Sums(int64_t node_count) { return kSumLanes * NodeSumBlocks(node_count); }
  int64_t SolvedUnknowns() const { return solved_nodes_ * Operator::kUnknowns; }

  void SetDiagonal() {
    executor_.ForEach("take the diagonal", node_count_,
                      InvertDiagonalBody<Operator>{matrix, inverse_diagonal_.View()});
  }

  GradientVectors Vectors() {
    return {ReadOnly(inverse_diagonal_.View()),
            ReadOnly(right_side.View()),
            x.View(),
            residual_.View(),
            direction_.View(),
            product_.View(),
            ReadOnly(numbers_.View())};
  }

  // Runs as many elements as the solve has left, none once it has ended.
  template <class Body>
  void ForLive(const char* description, int place, int64_t count, const Body& body) {
    executor_.ForEachOf(description, count, {counts_.View().data + place, 1}, body);
  }

  // What follows from the numbers that are solved for.
  void Complete(Array<float>& to, ArrayView<const float> of_right_side) {
    if constexpr (Operator::kCompletes) {
      ForLive("complete", kLiveOthers, node_count_ - solved_nodes_,
              CompleteBody<Operator>{matrix, of_right_side, to.View()});
    }
  }
  void Apply(const Array<float>& to) {
    for (int pass = 0; pass < Operator::kPasses; ++pass) {
      ForLive("apply the matrix", kLiveNodes, solved_nodes_,
              ApplyBody<Operator>{matrix, pass, to.View(), scratch_.View(), product_.View()});
    }
  }

  // Partial sums over so many nodes.
  template <class Term>
  PartialSumBody<Term> SumOver(int64_t node_count, const Term& term) {
    return {node_count * Operator::kUnknowns,
            kNodesPerSum * Operator::kUnknowns,
            term,
            {partial_.View().data, Sums(node_count)}};
  }
  template <class Term>
  void Sum(const Term& term) {
    ForLive("sum", kLiveSums, Sums(solved_nodes_), SumOver(solved_nodes_, term));
  }
  template <class Body>
  void Decide(const char* description, Body body) {
    DecideOf(solved_nodes_, description, body);
  }
  template <class Body>
  void DecideOf(int64_t node_count, const char* description, Body body) {
    body.partial = {partial_.View().data, Sums(node_count)};
    body.counts = counts_.View();
    body.numbers = numbers_.View();
    OrderedTotal<E>::Decide(executor_, description, {counts_.View().data + kIsLive, 1}, body);
  }

  void Start(double tolerance) {
    Complete(x, ReadOnly(right_side.View()));
    Apply(x);
    ForLive("start", kLiveUnknowns, SolvedUnknowns(), StartBody{Vectors()});
    executor_.ForEach("sum", Sums(node_count_),
                      SumOver(node_count_, SquareTerm{ReadOnly(right_side.View()),
                                                      ReadOnly(inverse_diagonal_.View())}));
    SetGoalBody set_goal;
    set_goal.tolerance = tolerance;
    DecideOf(node_count_, "set the goal", set_goal);
    Sum(ProductTerm{ReadOnly(residual_.View()), ReadOnly(direction_.View())});
    Decide("begin", BeginBody());
  }

  void Iterate() {
    Complete(direction_, {});
    Apply(direction_);
    Sum(ProductTerm{ReadOnly(direction_.View()), ReadOnly(product_.View())});
    Decide("choose the step", ChooseStepBody());
    ForLive("move", kLiveUnknowns, SolvedUnknowns(), MoveBody{Vectors()});
    Sum(SquareTerm{ReadOnly(residual_.View()), ReadOnly(inverse_diagonal_.View())});
    Decide("choose the carry", ChooseCarryBody());
    ForLive("turn", kLiveUnknowns, SolvedUnknowns(), TurnBody{Vectors()});
  }

  E& executor_;
  int64_t node_count_, unknowns_;
  int64_t solved_nodes_ = 0;
  Array<float> residual_, direction_, product_, scratch_;
  Array<double> partial_, numbers_;
  Array<int64_t> counts_;
  Array<float> inverse_diagonal_;
};

}  // namespace amhex::fields
