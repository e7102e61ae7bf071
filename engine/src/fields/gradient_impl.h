// Conjugate gradients (conjugate_gradient.h) as a template over the executor and the matrix. The
// numbers that decide how it goes on stay where bodies run; the bits are those of the host's
// solver.
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "fields/find_neighbours.h"
#include "fields/gradient_bodies.h"
#include "fields/gradient_task.h"
#include "fields/ordered_total.h"
#include "fields/phase_seeds_impl.h"
#include "fields/sum_blocks.h"

namespace amhex::fields {

// One object per solve, or per solves in a row.
template <class E, class Operator>
class GradientSolve {
 public:
  GradientSolve(E& executor, GradientTask& task)
      : executor_(executor),
        task_(task),
        unknowns_(task.unknown_count()),
        sums_(kSumLanes * NodeSumBlocks(task.node_count)),
        arrays_(executor) {}

  // Memory where bodies run, beyond what is there.
  static int64_t Bytes(const GradientTask& task) {
    constexpr int64_t kVectors = 6;  // right side, diagonal, x, residual, direction, product
    int64_t sum = kVectors * task.unknown_count() * static_cast<int64_t>(sizeof(float));
    sum += task.node_count * Operator::kScratch * static_cast<int64_t>(sizeof(float));
    sum += kSumLanes * NodeSumBlocks(task.node_count) * static_cast<int64_t>(sizeof(double));
    if (task.course != nullptr) {
      // Hull targets and weights, and turns; what those are made of is gone before the first solve.
      sum += (task.unknown_count() + 3 * task.node_count) * static_cast<int64_t>(sizeof(float));
      sum += task.node_count * (kTurns * static_cast<int64_t>(sizeof(float)) + 1);
    }
    const Operator& matrix = std::get<Operator>(task.matrix);
    const bool has_links = task.links != nullptr && *task.links != nullptr;
    return sum + UploadedArrays<E>::Bytes(matrix) +
           (has_links ? -UploadedArrays<E>::Bytes(matrix.links) : BytesOfViewsThere<E>(task.cells));
  }

  // False if it was stopped.
  bool Run() {
    if (task_.course != nullptr) {
      TakeCourse(*task_.course);
    } else {
      Upload();
      right_side_ = Uploaded(executor_, task_.right_side.data, unknowns_);
      AllocateVectors();
      SetDiagonal();
      Solve(task_.limits);
    }
    std::vector<float> x(static_cast<size_t>(unknowns_));
    int64_t counts[kCountsSize] = {};
    executor_.CopyOutLater(x_, unknowns_, x.data());
    executor_.CopyOutLater(counts_, kCountsSize, counts);
    executor_.Synchronize();
    if (executor_.Stopped()) return false;
    *task_.x = std::move(x);
    task_.iterations = static_cast<int32_t>(counts[kIterationsDone]);
    return true;
  }

 private:
  template <class T>
  using Array = Buffer<E, T>;

  void Upload() {
    Operator host = std::get<Operator>(task_.matrix);
    const NodeLinks links = std::exchange(host.links, {});
    matrix_ = arrays_.Upload(host);
    matrix_.links = LinksThere(links);
    scratch_ = executor_.template Alloc<float>(task_.node_count * Operator::kScratch);
    partial_ = executor_.template Alloc<double>(sums_);
    numbers_ = executor_.template Alloc<double>(kNumbersSize);
    counts_ = executor_.template Alloc<int64_t>(kCountsSize);
    inverse_diagonal_ = executor_.template Alloc<float>(unknowns_);
    x_ = Zeros(unknowns_);
  }
  NodeLinks LinksThere(const NodeLinks& host) {
    if (task_.links == nullptr) return arrays_.Upload(host);
    if (task_.cells.count() == 0) return OnResidentArrays<E>(*task_.links, host);
    const CellCentres cells = ViewsThere(arrays_, task_.cells);
    return Resident<E>(*task_.links, [&](UploadedArrays<E>& arrays) {
      NodeLinks there = host;
      there.neighbours = {};
      there = arrays.Upload(there);
      const auto neighbours = arrays.template AddArray<int32_t>(host.neighbours.size);
      arrays.executor().ForEach("find neighbours", cells.count(),
                                FindAxisNeighboursBody{cells.keys, neighbours});
      there.neighbours = ReadOnly(neighbours);
      return there;
    });
  }
  Array<float> Zeros(int64_t count) {
    Array<float> zeros = executor_.template Alloc<float>(count);
    executor_.ForEach("start at zero", count, ClearBody{zeros.View()});
    return zeros;
  }

  void AllocateVectors() {
    residual_ = executor_.template Alloc<float>(unknowns_);
    direction_ = executor_.template Alloc<float>(unknowns_);
    product_ = executor_.template Alloc<float>(unknowns_);
  }

  void Solve(const SolveLimits& limits) {
    executor_.ForEach("begin to count", 1,
                      BeginCountsBody{unknowns_, task_.node_count, sums_, counts_.View()});
    Start(limits.tolerance);
    executor_.Repeat(
        limits.max_iterations, counts_, [this] { Iterate(); },
        [](const int64_t* counts) { return counts[kIsLive] == 0; });
  }

  void TakeCourse(const PhaseCourse& course) {
    if constexpr (std::is_same_v<Operator, PhaseOperator>) {
      MeetDemands(course.demands);
      AllocateVectors();
      SetDiagonal();
      Solve(course.first);
      const Array<float> hull_target = std::move(right_side_);
      // The walk takes less than these.
      residual_ = {}, direction_ = {}, product_ = {};
      PhaseSeeds<E>(executor_, matrix_, x_.View()).Run();
      AllocateVectors();
      right_side_ = executor_.template Alloc<float>(unknowns_);
      TakeRounds(course, hull_target);
    }
  }

  // Makes the matrix; the hull's targets are the right side of the plain solve.
  void MeetDemands(const PhaseDemands& host) {
    UploadedArrays<E> arrays(executor_);
    const PhaseDemands demands = arrays.Upload(host);
    Upload();
    turns_ = executor_.template Alloc<float>(kTurns * task_.node_count);
    edge_count_ = executor_.template Alloc<uint8_t>(task_.node_count);
    executor_.ForEach(
        "turn edges", task_.node_count,
        TurnEdgesBody{matrix_.links, demands.increments, turns_.View(), edge_count_.View()});
    hull_weight_ = Zeros(3 * task_.node_count), right_side_ = Zeros(unknowns_);
    executor_.ForEach("spread the hull's wishes", demands.hull.nodes.size,
                      SpreadWishesBody{demands.hull, hull_weight_.View(), right_side_.View()});
    matrix_.turns = ReadOnly(turns_.View()), matrix_.edge_count = ReadOnly(edge_count_.View());
    matrix_.hull_weight = ReadOnly(hull_weight_.View());
  }

  void TakeRounds(const PhaseCourse& course, const Array<float>& hull_target) {
    int32_t round = 0;
    for (const float pull : course.pulls) {
      if (executor_.Stopped()) return;
      if (course.on_round) course.on_round(round++);
      matrix_.pull = pull;
      executor_.ForEach(
          "pull to unit length", unknowns_ / 2,
          PullBody{hull_target.View(), ReadOnly(x_.View()), pull, right_side_.View()});
      SetDiagonal();
      Solve(task_.limits);
    }
  }

  void SetDiagonal() {
    executor_.ForEach("take the diagonal", task_.node_count,
                      InvertDiagonalBody<Operator>{matrix_, inverse_diagonal_.View()});
  }

  GradientVectors Vectors() {
    return {ReadOnly(inverse_diagonal_.View()),
            ReadOnly(right_side_.View()),
            x_.View(),
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

  void Apply(const Array<float>& to) {
    for (int pass = 0; pass < Operator::kPasses; ++pass) {
      ForLive("apply the matrix", kLiveNodes, task_.node_count,
              ApplyBody<Operator>{matrix_, pass, to.View(), scratch_.View(), product_.View()});
    }
  }

  template <class Term>
  void Sum(const Term& term) {
    constexpr int64_t kPerBlock = kNodesPerSum * Operator::kUnknowns;
    ForLive("sum", kLiveSums, sums_,
            PartialSumBody<Term>{unknowns_, kPerBlock, term, partial_.View()});
  }
  template <class Body>
  void Decide(const char* description, Body body) {
    body.partial = ReadOnly(partial_.View());
    body.counts = counts_.View();
    body.numbers = numbers_.View();
    OrderedTotal<E>::Decide(executor_, description, {counts_.View().data + kIsLive, 1}, body);
  }

  void Start(double tolerance) {
    Apply(x_);
    ForLive("start", kLiveUnknowns, unknowns_, StartBody{Vectors()});
    Sum(SquareTerm{ReadOnly(right_side_.View()), ReadOnly(inverse_diagonal_.View())});
    SetGoalBody set_goal;
    set_goal.tolerance = tolerance;
    Decide("set the goal", set_goal);
    Sum(ProductTerm{ReadOnly(residual_.View()), ReadOnly(direction_.View())});
    Decide("begin", BeginBody());
  }

  void Iterate() {
    Apply(direction_);
    Sum(ProductTerm{ReadOnly(direction_.View()), ReadOnly(product_.View())});
    Decide("choose the step", ChooseStepBody());
    ForLive("move", kLiveUnknowns, unknowns_, MoveBody{Vectors()});
    Sum(SquareTerm{ReadOnly(residual_.View()), ReadOnly(inverse_diagonal_.View())});
    Decide("choose the carry", ChooseCarryBody());
    ForLive("turn", kLiveUnknowns, unknowns_, TurnBody{Vectors()});
  }

  E& executor_;
  GradientTask& task_;
  int64_t unknowns_;
  int64_t sums_;
  UploadedArrays<E> arrays_;  // of the matrix
  Operator matrix_;
  Array<float> inverse_diagonal_, right_side_, x_, residual_, direction_, product_, scratch_;
  // Of a course.
  static constexpr int64_t kTurns = 18;  // numbers per node
  Array<float> turns_, hull_weight_;
  Array<uint8_t> edge_count_;
  Array<double> partial_, numbers_;
  Array<int64_t> counts_;
};

}  // namespace amhex::fields
