// Gluing pairs of faces where bodies run: what one after the other would glue, in rounds. Every
// pair wants the sets of its eight corners, and has its turn when no earlier one that is left wants
// one of them: earlier pairs with sets of their own cannot matter to it.
#pragma once

#include <cstdint>
#include <limits>
#include <utility>

#include "base/ordered_bits.h"
#include "exec/counted_list.h"
#include "exec/executor.h"
#include "geometry/cut_search.h"
#include "geometry/merge_view.h"

namespace amhex {

// Keys of items for sorting them by several numbers, the last one first: each structure has
//   AMHEX_HD uint32_t operator()(const Item& item) const;
struct ScoreKey {
  int shift = 0;  // 32 of the ordered bits
  AMHEX_HD uint32_t operator()(const FacePair& pair) const {
    return static_cast<uint32_t>(OrderedBits(pair.score) >> shift);
  }
};
struct CubeKey {
  bool is_of_a = false;
  AMHEX_HD uint32_t operator()(const FacePair& pair) const {
    return static_cast<uint32_t>(is_of_a ? pair.cube_a : pair.cube_b);
  }
};
struct DirectionsKey {
  AMHEX_HD uint32_t operator()(const FacePair& pair) const {
    return static_cast<uint32_t>(kDirectionCount * pair.direction_a + pair.direction_b);
  }
};
struct EdgeEndKey {
  bool is_of_low = false;
  AMHEX_HD uint32_t operator()(const OpenEdge& edge) const {
    return static_cast<uint32_t>(is_of_low ? edge.low : edge.high);
  }
};

template <class Item, class Key>
struct KeyItemsBody {
  ArrayView<const Item> items;
  Key key_of;
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;
  AMHEX_HD void operator()(int64_t i) const {
    key[i] = key_of(items[i]);
    id[i] = static_cast<int32_t>(i);
  }
};
template <class Item>
struct GatherItemsBody {
  ArrayView<const Item> items;
  ArrayView<const int32_t> order;
  ArrayView<Item> sorted;
  AMHEX_HD void operator()(int64_t i) const { sorted[i] = items[order[i]]; }
};

// Equal ones in their order.
template <class E, class Item, class Key>
Buffer<E, Item> SortedBy(E& executor, const Buffer<E, Item>& items, const Key& key,
                         uint32_t largest) {
  const int64_t count = items.size();
  KeyedIds<E> pairs{executor.template Alloc<uint32_t>(count),
                    executor.template Alloc<int32_t>(count)};
  KeyedIds<E> order{executor.template Alloc<uint32_t>(count),
                    executor.template Alloc<int32_t>(count)};
  executor.ForEach("take keys", count,
                   KeyItemsBody<Item, Key>{items.View(), key, pairs.key.View(), pairs.id.View()});
  executor.SortByKey(pairs, count, largest, order);
  Buffer<E, Item> sorted = executor.template Alloc<Item>(count);
  executor.ForEach("put in order", count,
                   GatherItemsBody<Item>{items.View(), ReadOnly(order.id.View()), sorted.View()});
  return sorted;
}

template <class E>
Buffer<E, FacePair> SortedByScore(E& executor, Buffer<E, FacePair> pairs) {
  constexpr uint32_t kAnyKey = std::numeric_limits<uint32_t>::max();
  constexpr int kKeyBits = 32;
  pairs = SortedBy<E>(executor, pairs, ScoreKey{0}, kAnyKey);
  return SortedBy<E>(executor, pairs, ScoreKey{kKeyBits}, kAnyKey);
}
// By score, cubes and directions.
template <class E>
Buffer<E, FacePair> SortedFully(E& executor, Buffer<E, FacePair> pairs, int64_t cube_count) {
  const auto largest_cube = static_cast<uint32_t>(Larger(cube_count - 1, int64_t{0}));
  pairs = SortedBy<E>(executor, pairs, DirectionsKey{}, kDirectionCount * kDirectionCount);
  pairs = SortedBy<E>(executor, pairs, CubeKey{false}, largest_cube);
  pairs = SortedBy<E>(executor, pairs, CubeKey{true}, largest_cube);
  return SortedByScore(executor, std::move(pairs));
}
template <class E>
Buffer<E, OpenEdge> SortedEdges(E& executor, Buffer<E, OpenEdge> edges, int64_t vertex_count) {
  const auto largest = static_cast<uint32_t>(Larger(vertex_count - 1, int64_t{0}));
  edges = SortedBy<E>(executor, edges, EdgeEndKey{false}, largest);
  return SortedBy<E>(executor, edges, EdgeEndKey{true}, largest);
}

// Memory of the pairs before and after a pass, and what it takes.
template <class E>
int64_t SortPairsBytes(int64_t count) {
  return count *
             static_cast<int64_t>(2 * sizeof(FacePair) + 2 * (sizeof(uint32_t) + sizeof(int32_t))) +
         E::SortBytes(count);
}

// What to glue, best first.
struct GlueRules {
  ArrayView<const FacePair> pairs;
  double max_score = 0;
  Collapse collapse = Collapse::kForbidden;
};

enum class GlueState : uint8_t { kWaiting, kGlued, kRefused };

struct StartGluingBody {
  ArrayView<GlueState> state;
  AMHEX_HD void operator()(int64_t i) const { state[i] = GlueState::kWaiting; }
};

// Of all pairs, or of those that a list names, the ones that still may be glued. A face that has
// been glued meanwhile was so by an earlier pair.
struct WaitingSearch {
  using Item = int32_t;
  MergeView sets;
  GlueRules rules;
  ArrayView<const GlueState> state;
  ArrayView<const int32_t> list;  // empty: all
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t index, const Visit& visit) const {
    const auto i = list.empty() ? static_cast<int32_t>(index) : list[index];
    const FacePair& pair = rules.pairs[i];
    if (pair.score > rules.max_score || state[i] != GlueState::kWaiting) return;
    if (sets.IsOpen(pair)) visit(i);
  }
};

inline constexpr uint64_t kNobody = std::numeric_limits<uint64_t>::max();

// One element of each of these per element of the list.
struct ForgetReservationsBody {
  MergeView sets;
  ArrayView<const FacePair> pairs;
  ArrayView<const int32_t> list;
  ArrayView<uint64_t> reserved;
  AMHEX_HD void operator()(int64_t index) const {
    for (const CornerPair& corners : CornersToMerge(pairs[list[index]])) {
      reserved[sets.Find(corners.first)] = kNobody;
      reserved[sets.Find(corners.second)] = kNobody;
    }
  }
};
struct ReserveBody {
  MergeView sets;
  ArrayView<const FacePair> pairs;
  ArrayView<const int32_t> list;
  ArrayView<uint64_t> reserved;
  AMHEX_HD void operator()(int64_t index) const {
    const auto turn = static_cast<uint64_t>(list[index]);
    for (const CornerPair& corners : CornersToMerge(pairs[list[index]])) {
      AtomicMin(&reserved[sets.Find(corners.first)], turn);
      AtomicMin(&reserved[sets.Find(corners.second)], turn);
    }
  }
};
// Marks those that have their turn, while no set changes.
struct TakeTurnsBody {
  MergeView sets;
  ArrayView<const FacePair> pairs;
  ArrayView<const int32_t> list;
  ArrayView<const uint64_t> reserved;
  ArrayView<uint8_t> has_turn;  // [index in the list]
  AMHEX_HD void operator()(int64_t index) const {
    const auto turn = static_cast<uint64_t>(list[index]);
    bool is_first = true;
    for (const CornerPair& corners : CornersToMerge(pairs[list[index]])) {
      is_first &= reserved[sets.Find(corners.first)] == turn;
      is_first &= reserved[sets.Find(corners.second)] == turn;
    }
    has_turn[index] = is_first ? 1 : 0;
  }
};
struct GlueBody {
  MergeView sets;
  GlueRules rules;
  ArrayView<const int32_t> list;
  ArrayView<const uint8_t> has_turn;
  ArrayView<GlueState> state;
  AMHEX_HD void operator()(int64_t index) const {
    if (has_turn[index] == 0) return;
    const int32_t i = list[index];
    state[i] =
        sets.TryGlue(rules.pairs[i], rules.collapse) ? GlueState::kGlued : GlueState::kRefused;
  }
};
struct IsGluedBody {
  ArrayView<const GlueState> state;
  AMHEX_HD int64_t operator()(int64_t i) const { return state[i] == GlueState::kGlued ? 1 : 0; }
};

// Returns how many were glued. `reserved` is room for one number per virtual vertex. Waits once in
// every round.
template <class E>
int64_t GlueInTurn(E& executor, const MergeView& sets, const GlueRules& rules,
                   ArrayView<uint64_t> reserved) {
  const int64_t count = rules.pairs.size;
  Buffer<E, GlueState> state = executor.template Alloc<GlueState>(count);
  executor.ForEach("start gluing", count, StartGluingBody{state.View()});
  const auto waiting = [&](ArrayView<const int32_t> list, int64_t list_count) {
    return ListItems(executor, "list pairs that wait", list_count,
                     WaitingSearch{sets, rules, ReadOnly(state.View()), list});
  };
  Buffer<E, int32_t> list = waiting({}, count);
  Buffer<E, uint8_t> has_turn = executor.template Alloc<uint8_t>(list.size());
  while (list.size() > 0 && !executor.Stopped()) {
    const ArrayView<const int32_t> view = ReadOnly(list.View());
    executor.ForEach("forget reservations", view.size,
                     ForgetReservationsBody{sets, rules.pairs, view, reserved});
    executor.ForEach("reserve sets", view.size, ReserveBody{sets, rules.pairs, view, reserved});
    executor.ForEach("take turns", view.size,
                     TakeTurnsBody{sets, rules.pairs, view, ReadOnly(reserved), has_turn.View()});
    executor.ForEach("glue faces", view.size,
                     GlueBody{sets, rules, view, ReadOnly(has_turn.View()), state.View()});
    list = waiting(view, view.size);
  }
  return executor.Reduce("count what was glued", count, IsGluedBody{ReadOnly(state.View())});
}

}  // namespace amhex
