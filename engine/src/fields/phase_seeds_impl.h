// The walks of phase_seeds.h where bodies run: all numbers that are still to be reached look for
// their neighbours at once.
#pragma once

#include <cstdint>
#include <utility>

#include "exec/counted_list.h"
#include "exec/executor.h"
#include "exec/rounds_per_look.h"
#include "fields/phase_walk.h"

namespace amhex::fields {

struct MarkStrongBody {
  PhaseWalk walk;
  AMHEX_HD void operator()(int64_t u) const {
    walk.step[u] = IsWeakPhase(walk.x.data, u) ? kNeverReached : 0;
  }
};

// Of all numbers, or of those that a list names, the ones that have not been reached.
struct UnreachedSearch {
  using Item = int64_t;
  ArrayView<const int32_t> step;
  ArrayView<const int64_t> list;
  bool is_of_all = false;
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t element, const Visit& visit) const {
    const int64_t u = is_of_all ? element : list[element];
    if (step[u] == kNeverReached) visit(u);
  }
};

// A neighbour that this step reaches is no neighbour of an earlier step, whether its step has been
// written already or not. Steps since the list was made may have reached some of it.
struct ReachBody {
  PhaseWalk walk;
  ArrayView<const int64_t> list;
  int32_t now = 0;
  AMHEX_HD void operator()(int64_t element) const {
    if (!walk.IsReached(list[element])) walk.Reach(list[element], now);
  }
};

// Every number learns the smallest one that it is connected to.
struct OwnLabelBody {
  ArrayView<const int64_t> list;
  ArrayView<int64_t> label;
  AMHEX_HD void operator()(int64_t element) const { label[list[element]] = list[element]; }
};
struct SpreadLabelBody {
  PhaseWalk walk;
  ArrayView<const int64_t> list;
  ArrayView<const int64_t> label;
  ArrayView<int64_t> next;
  AMHEX_HD void operator()(int64_t element) const {
    const int64_t u = list[element];
    // Whoever stands for this number may have learned of a smaller one.
    int64_t smallest = label[label[u]];
    walk.VisitNeighbours(u, [&](int64_t v) { smallest = Smaller(smallest, label[v]); });
    next[u] = smallest;
  }
};
struct HasChangedBody {
  ArrayView<const int64_t> list, label, next;
  AMHEX_HD int64_t operator()(int64_t element) const {
    return label[list[element]] == next[list[element]] ? 0 : 1;
  }
};
struct StartSmallestBody {
  PhaseWalk walk;
  ArrayView<const int64_t> list, label;
  int32_t now = 0;
  AMHEX_HD void operator()(int64_t element) const {
    if (label[list[element]] == list[element]) walk.Start(list[element], now);
  }
};

// One object per walk.
template <class E>
class PhaseSeeds {
 public:
  PhaseSeeds(E& executor, const PhaseOperator& matrix, ArrayView<float> x)
      : executor_(executor),
        step_(executor.template Alloc<int32_t>(x.size / 2)),
        walk_{matrix, x, step_.View()} {}

  void Run() {
    const int64_t count = step_.size();
    executor_.ForEach("mark strong phases", count, MarkStrongBody{walk_});
    list_ = executor_.template Alloc<int64_t>(0);
    list_ = Unreached(count, true);
    // Waits once in so many steps: those that reach nothing only count on.
    for (int32_t now = 1; list_.size() > 0 && !executor_.Stopped(); ++now) {
      const int64_t left = list_.size();
      for (int step = 0; step < kRoundsPerLook; ++step, ++now) {
        executor_.ForEach("carry phases on", left, ReachBody{walk_, List(), now});
      }
      Buffer<E, int64_t> next = Unreached(left, false);
      if (next.size() == left) StartSmallest(now);
      list_ = next.size() == left ? Unreached(left, false) : std::move(next);
    }
  }

 private:
  ArrayView<const int64_t> List() { return ReadOnly(list_.View()); }

  Buffer<E, int64_t> Unreached(int64_t count, bool is_of_all) {
    return ListItems(executor_, "list phases that are not reached", count,
                     UnreachedSearch{ReadOnly(step_.View()), List(), is_of_all});
  }

  // Nothing that is left has a neighbour that was reached: every connected part starts by itself.
  void StartSmallest(int32_t now) {
    const int64_t left = list_.size();
    Buffer<E, int64_t> label = executor_.template Alloc<int64_t>(step_.size());
    Buffer<E, int64_t> next = executor_.template Alloc<int64_t>(step_.size());
    executor_.ForEach("name parts", left, OwnLabelBody{List(), label.View()});
    int64_t changes = left;
    while (changes > 0 && !executor_.Stopped()) {
      for (int round = 0; round < kRoundsPerLook; ++round) {
        executor_.ForEach("spread names", left,
                          SpreadLabelBody{walk_, List(), ReadOnly(label.View()), next.View()});
        std::swap(label, next);
      }
      changes =
          executor_.Reduce("count new names", left,
                           HasChangedBody{List(), ReadOnly(label.View()), ReadOnly(next.View())});
    }
    executor_.ForEach("start phases", left,
                      StartSmallestBody{walk_, List(), ReadOnly(label.View()), now});
  }

  E& executor_;
  Buffer<E, int32_t> step_;
  PhaseWalk walk_;
  Buffer<E, int64_t> list_;  // of what is to be reached
};

}  // namespace amhex::fields
