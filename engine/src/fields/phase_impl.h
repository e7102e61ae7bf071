// The solves of a phase field (phase_course.h) with arrays where bodies run, with the bits of the
// host's.
#pragma once

#include <cstdint>
#include <utility>

#include "exec/counted_list.h"
#include "exec/executor.h"
#include "fields/gradient_loop.h"
#include "fields/node_order.h"
#include "fields/phase_course.h"
#include "fields/phase_seeds_impl.h"

namespace amhex::fields {

struct NodesOfParity {
  using Item = int32_t;
  ArrayView<const uint64_t> keys;
  bool is_even = true;
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t node, const Visit& visit) const {
    if (IsOfEvenCell(keys[node]) == is_even) visit(static_cast<int32_t>(node));
  }
};
// Nodes in their order, from a number on; one element per node that is listed.
struct NumberNodesBody {
  ArrayView<const int32_t> listed;
  int64_t first = 0;
  ArrayView<int32_t> node_of, number_of;
  AMHEX_HD void operator()(int64_t k) const {
    node_of[first + k] = listed[k];
    number_of[listed[k]] = static_cast<int32_t>(first + k);
  }
};

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
    // Turns, weights of the hull's wishes, their targets; the order, both ways, with its links;
    // codes, edges.
    constexpr int64_t kNumbers = kTurns + 3 + PhaseOperator::kUnknowns;
    constexpr int64_t kOfOrder = 2 + kNeighbours;
    return GradientLoop<E, PhaseOperator>::Bytes(node_count) +
           node_count * (kNumbers * static_cast<int64_t>(sizeof(float)) +
                         kOfOrder * static_cast<int64_t>(sizeof(int32_t)) + kCodes + 1);
  }

  // [6 * node + 2 * axis] real and imaginary part. `links` are between the nodes of these cells.
  // What make_demands() returns has a member `demands` and is gone before the first solve.
  template <class MakeDemands>
  Buffer<E, float> Run(ArrayView<const uint64_t> keys, const NodeLinks& links,
                       const MakeDemands& make_demands) {
    Number(keys);
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
    loop_.Rest();
    Buffer<E, float> by_node = executor_.template Alloc<float>(loop_.unknowns());
    executor_.ForEach("give phases to their nodes", node_count_,
                      OfNodesBody{order_, ReadOnly(loop_.x.View()), by_node.View()});
    return by_node;
  }

 private:
  // Per node.
  static constexpr int64_t kTurns = 18;  // numbers
  static constexpr int64_t kNeighbours = 6, kCodes = 3;

  void Number(ArrayView<const uint64_t> keys) {
    node_of_ = executor_.template Alloc<int32_t>(node_count_);
    number_of_ = executor_.template Alloc<int32_t>(node_count_);
    int64_t first = 0;
    for (const bool is_even : {true, false}) {
      const Buffer<E, int32_t> listed =
          ListItems(executor_, "list nodes by parity", node_count_, NodesOfParity{keys, is_even});
      executor_.ForEach(
          "number nodes", listed.size(),
          NumberNodesBody{ReadOnly(listed.View()), first, node_of_.View(), number_of_.View()});
      if (is_even) first = listed.size();
    }
    order_ = {ReadOnly(node_of_.View()), ReadOnly(number_of_.View()), first};
  }

  // Makes the matrix; the hull's targets are the right side of the plain solve.
  void Meet(const NodeLinks& links, const PhaseDemands& demands) {
    neighbours_ = executor_.template Alloc<int32_t>(kNeighbours * node_count_);
    codes_ = executor_.template Alloc<uint8_t>(kCodes * node_count_);
    executor_.ForEach("renumber links", node_count_,
                      RenumberLinksBody{links, order_, neighbours_.View(), codes_.View()});
    const NodeLinks renumbered = {ReadOnly(neighbours_.View()), ReadOnly(codes_.View()),
                                  links.renamings};
    turns_ = executor_.template Alloc<float>(kTurns * node_count_);
    edge_count_ = executor_.template Alloc<uint8_t>(node_count_);
    executor_.ForEach(
        "turn edges", node_count_,
        TurnEdgesBody{renumbered, order_, demands.increments, turns_.View(), edge_count_.View()});
    hull_weight_ = loop_.Zeros(3 * node_count_), loop_.right_side = loop_.Zeros(loop_.unknowns());
    executor_.ForEach(
        "spread the hull's wishes", demands.hull.nodes.size,
        SpreadWishesBody{demands.hull, order_, hull_weight_.View(), loop_.right_side.View()});
    loop_.matrix = {renumbered,
                    ReadOnly(turns_.View()),
                    ReadOnly(edge_count_.View()),
                    ReadOnly(hull_weight_.View()),
                    kPlainPull,
                    order_.even_count};
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
  Buffer<E, int32_t> node_of_, number_of_;
  NodeOrder order_;
  Buffer<E, int32_t> neighbours_;  // between numbers of the order
  Buffer<E, uint8_t> codes_;       // likewise
  Buffer<E, float> turns_, hull_weight_;
  Buffer<E, uint8_t> edge_count_;
};

}  // namespace amhex::fields
