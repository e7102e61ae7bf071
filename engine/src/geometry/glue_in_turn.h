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
#include "exec/rounds_per_look.h"
#include "exec/sorted_items.h"
#include "geometry/cut_search.h"
#include "geometry/merge_view.h"

namespace amhex {

// Keys for sorting (sorted_items.h).
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

// Pairs on their way through the rounds.
struct PairsInTurn {
  MergeView sets;
  GlueRules rules;
  ArrayView<const GlueState> state;

  // Whether one still may be glued. A face that has been glued meanwhile was so by an earlier pair.
  AMHEX_HD bool Waits(int32_t i) const {
    const FacePair& pair = rules.pairs[i];
    if (pair.score > rules.max_score || state[i] != GlueState::kWaiting) return false;
    return sets.IsOpen(pair);
  }
};

// All pairs, or those that a list names.
struct PairList {
  int64_t count = 0;
  ArrayView<const int32_t> list;  // empty: all
  AMHEX_HD int32_t operator[](int64_t index) const {
    return list.empty() ? static_cast<int32_t>(index) : list[index];
  }
};

// Those of a list that wait.
struct WaitingSearch {
  using Item = int32_t;
  PairsInTurn pairs;
  PairList list;
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t index, const Visit& visit) const {
    if (pairs.Waits(list[index])) visit(list[index]);
  }
};

inline constexpr uint64_t kNobody = std::numeric_limits<uint64_t>::max();

// One element of each of these per element of a list, of which rounds since it was made may have
// dealt with some.
struct ForgetReservationsBody {
  PairsInTurn pairs;
  PairList list;
  ArrayView<uint64_t> reserved;
  AMHEX_HD void operator()(int64_t index) const {
    if (!pairs.Waits(list[index])) return;
    for (const CornerPair& corners : CornersToMerge(pairs.rules.pairs[list[index]])) {
      reserved[pairs.sets.Find(corners.first)] = kNobody;
      reserved[pairs.sets.Find(corners.second)] = kNobody;
    }
  }
};
struct ReserveBody {
  PairsInTurn pairs;
  PairList list;
  ArrayView<uint64_t> reserved;
  AMHEX_HD void operator()(int64_t index) const {
    if (!pairs.Waits(list[index])) return;
    const auto turn = static_cast<uint64_t>(list[index]);
    for (const CornerPair& corners : CornersToMerge(pairs.rules.pairs[list[index]])) {
      AtomicMin(&reserved[pairs.sets.Find(corners.first)], turn);
      AtomicMin(&reserved[pairs.sets.Find(corners.second)], turn);
    }
  }
};
// Marks those that have their turn, while no set changes.
struct TakeTurnsBody {
  PairsInTurn pairs;
  PairList list;
  ArrayView<const uint64_t> reserved;
  ArrayView<uint8_t> has_turn;  // [index in the list]
  AMHEX_HD void operator()(int64_t index) const {
    const auto turn = static_cast<uint64_t>(list[index]);
    bool is_first = pairs.Waits(list[index]);
    for (const CornerPair& corners : CornersToMerge(pairs.rules.pairs[list[index]])) {
      is_first = is_first && reserved[pairs.sets.Find(corners.first)] == turn &&
                 reserved[pairs.sets.Find(corners.second)] == turn;
    }
    has_turn[index] = is_first ? 1 : 0;
  }
};
struct GlueBody {
  PairsInTurn pairs;
  PairList list;
  ArrayView<const uint8_t> has_turn;
  ArrayView<GlueState> state;  // that of the pairs
  AMHEX_HD void operator()(int64_t index) const {
    if (has_turn[index] == 0) return;
    const int32_t i = list[index];
    const bool is_glued = pairs.sets.TryGlue(pairs.rules.pairs[i], pairs.rules.collapse);
    state[i] = is_glued ? GlueState::kGlued : GlueState::kRefused;
  }
};

// Two numbers in one: how many wait, and as often as this how many are glued.
inline constexpr int64_t kOneGlued = int64_t{1} << 32;
struct WaitsOrIsGluedBody {
  PairsInTurn pairs;
  PairList list;
  AMHEX_HD int64_t operator()(int64_t index) const {
    if (pairs.state[list[index]] == GlueState::kGlued) return kOneGlued;
    return pairs.Waits(list[index]) ? 1 : 0;
  }
};

// Where the rounds keep what they find out.
struct GlueRoom {
  ArrayView<uint64_t> reserved;  // [virtual vertex]
  ArrayView<uint8_t> has_turn;   // [index in the list]
  ArrayView<GlueState> state;    // [pair]
};

// The next round for those of a list that wait.
template <class E>
void TakeGlueRound(E& executor, const PairsInTurn& pairs, const PairList& list,
                   const GlueRoom& room) {
  executor.ForEach("forget reservations", list.count,
                   ForgetReservationsBody{pairs, list, room.reserved});
  executor.ForEach("reserve sets", list.count, ReserveBody{pairs, list, room.reserved});
  executor.ForEach("take turns", list.count,
                   TakeTurnsBody{pairs, list, ReadOnly(room.reserved), room.has_turn});
  executor.ForEach("glue faces", list.count,
                   GlueBody{pairs, list, ReadOnly(room.has_turn), room.state});
}

// Returns how many were glued. `reserved` is room for one number per virtual vertex. Waits once or
// twice in kRoundsPerLook rounds.
template <class E>
int64_t GlueInTurn(E& executor, const MergeView& sets, const GlueRules& rules,
                   ArrayView<uint64_t> reserved) {
  // Looking at so many pairs that do not wait costs less than listing those that do.
  constexpr int64_t kFewPairs = 1 << 14;
  const int64_t count = rules.pairs.size;
  Buffer<E, GlueState> state = executor.template Alloc<GlueState>(count);
  executor.ForEach("start gluing", count, StartGluingBody{state.View()});
  const PairsInTurn pairs{sets, rules, ReadOnly(state.View())};
  PairList list{count, {}};
  Buffer<E, int32_t> waiting;
  const auto list_waiting = [&] {
    waiting = ListItems(executor, "list pairs that wait", list.count, WaitingSearch{pairs, list});
    list = {waiting.size(), ReadOnly(waiting.View())};
  };
  if (count > kFewPairs) list_waiting();
  Buffer<E, uint8_t> has_turn = executor.template Alloc<uint8_t>(list.count);
  int64_t glued = 0;
  while (list.count > 0 && !executor.Stopped()) {
    for (int round = 0; round < kRoundsPerLook; ++round) {
      TakeGlueRound(executor, pairs, list, {reserved, has_turn.View(), state.View()});
    }
    const int64_t sum =
        executor.Reduce("see what is glued", list.count, WaitsOrIsGluedBody{pairs, list});
    glued += sum / kOneGlued;
    if (sum % kOneGlued == 0) break;
    list_waiting();
  }
  return glued;
}

}  // namespace amhex
