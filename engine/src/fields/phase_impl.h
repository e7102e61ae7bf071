// The solves of a phase field (phase_course.h) with arrays where bodies run, with the bits of the
// host's.
#pragma once

#include <cstdint>
#include <utility>

#include "exec/executor.h"
#include "fields/gradient_loop.h"
#include "fields/phase_course.h"
#include "fields/phase_seeds_impl.h"

namespace amhex::fields {

// One object per field.
template <class E>
class PhaseSolve {
 public:
  PhaseSolve(E& executor, const PhaseCourse& course, int64_t node_count)
      : executor_(executor),
        course_(course),
        node_count_(node_count),
        loop_(executor, node_count) {}

  // Memory where bodies run, but for the links and what is demanded.
  static int64_t Bytes(int64_t node_count) {
    // Turns, weights of the hull's wishes, their targets; edges.
    constexpr int64_t kNumbers = kTurns + 3 + PhaseOperator::kUnknowns;
    return GradientLoop<E, PhaseOperator>::Bytes(node_count) +
           node_count * (kNumbers * static_cast<int64_t>(sizeof(float)) + 1);
  }

  // [6 * node + 2 * axis] real and imaginary part. What make_demands() returns has a member
  // `demands` and is gone before the first solve.
  template <class MakeDemands>
  Buffer<E, float> Run(const NodeLinks& links, const MakeDemands& make_demands) {
    {
      const auto made = make_demands();
      Meet(links, made.demands);
    }
    loop_.Prepare();
    loop_.Solve(course_.first);
    const Buffer<E, float> hull_target = std::move(loop_.right_side);
    loop_.Rest();  // the walk takes less than this
    PhaseSeeds<E>(executor_, loop_.matrix, loop_.x.View()).Run();
    loop_.Prepare();
    loop_.right_side = executor_.template Alloc<float>(loop_.unknowns());
    TakeRounds(hull_target);
    return std::move(loop_.x);
  }

 private:
  static constexpr int64_t kTurns = 18;  // numbers per node

  // Makes the matrix; the hull's targets are the right side of the plain solve.
  void Meet(const NodeLinks& links, const PhaseDemands& demands) {
    turns_ = executor_.template Alloc<float>(kTurns * node_count_);
    edge_count_ = executor_.template Alloc<uint8_t>(node_count_);
    executor_.ForEach("turn edges", node_count_,
                      TurnEdgesBody{links, demands.increments, turns_.View(), edge_count_.View()});
    hull_weight_ = loop_.Zeros(3 * node_count_), loop_.right_side = loop_.Zeros(loop_.unknowns());
    executor_.ForEach("spread the hull's wishes", demands.hull.nodes.size,
                      SpreadWishesBody{demands.hull, hull_weight_.View(), loop_.right_side.View()});
    loop_.matrix = {links, ReadOnly(turns_.View()), ReadOnly(edge_count_.View()),
                    ReadOnly(hull_weight_.View()), kPlainPull};
  }

  void TakeRounds(const Buffer<E, float>& hull_target) {
    int32_t round = 0;
    for (const float pull : course_.pulls) {
      if (executor_.Stopped()) return;
      if (course_.on_round) course_.on_round(round++);
      loop_.matrix.pull = pull;
      executor_.ForEach(
          "pull to unit length", loop_.unknowns() / 2,
          PullBody{hull_target.View(), ReadOnly(loop_.x.View()), pull, loop_.right_side.View()});
      loop_.Solve(course_.later);
    }
  }

  E& executor_;
  const PhaseCourse& course_;
  int64_t node_count_;
  GradientLoop<E, PhaseOperator> loop_;
  Buffer<E, float> turns_, hull_weight_;
  Buffer<E, uint8_t> edge_count_;
};

}  // namespace amhex::fields
