// A greedy choice where bodies run: what one choice after the other would choose, in rounds. In
// each an element is chosen if nobody before it, still undecided, would claim it.
#pragma once

#include <cstdint>
#include <limits>
#include <utility>

#include "base/ordered_bits.h"
#include "exec/counted_list.h"
#include "exec/executor.h"
#include "exec/rounds_per_look.h"

namespace amhex {

enum class ChoiceState : uint8_t { kUndecided, kChosen, kOut };

// Of all elements, or of those that a list names, the undecided ones.
struct UndecidedSearch {
  using Item = int32_t;
  ArrayView<const ChoiceState> state;
  ArrayView<const int32_t> list;  // empty: all
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t index, const Visit& visit) const {
    const auto element = list.empty() ? static_cast<int32_t>(index) : list[index];
    if (state[element] == ChoiceState::kUndecided) visit(element);
  }
};

// One element of each of these per element of the list, of which rounds since it was made may have
// decided some. `first_claim`: by whom an undecided element would be claimed first, by itself if by
// nobody before it.
struct NoClaimBody {
  ArrayView<const int32_t> list;
  ArrayView<const ChoiceState> state;
  ArrayView<uint64_t> first_claim;
  AMHEX_HD void operator()(int64_t index) const {
    constexpr uint64_t kIsDecided = std::numeric_limits<uint64_t>::max();
    const int32_t element = list[index];
    const bool is_undecided = state[element] == ChoiceState::kUndecided;
    first_claim[element] = is_undecided ? static_cast<uint64_t>(element) : kIsDecided;
  }
};
template <class Claims>
struct WouldClaimBody {
  Claims claims;
  ArrayView<const int32_t> list;
  ArrayView<const ChoiceState> state;
  ArrayView<uint64_t> first_claim;
  AMHEX_HD void operator()(int64_t index) const {
    const int32_t element = list[index];
    if (state[element] != ChoiceState::kUndecided) return;
    claims.VisitClaimed(element, [&](int32_t other) {
      if (other <= element || state[other] != ChoiceState::kUndecided) return;
      AtomicMin(&first_claim[other], static_cast<uint64_t>(element));
    });
  }
};
struct ChooseBody {
  ArrayView<const int32_t> list;
  ArrayView<const uint64_t> first_claim;
  ArrayView<ChoiceState> state;
  AMHEX_HD void operator()(int64_t index) const {
    const int32_t element = list[index];
    if (first_claim[element] == static_cast<uint64_t>(element)) {
      state[element] = ChoiceState::kChosen;
    }
  }
};
// Nobody who is chosen is claimed by another of the round. Several may write, all the same.
template <class Claims>
struct ClaimBody {
  Claims claims;
  ArrayView<const int32_t> list;
  ArrayView<const uint64_t> first_claim;
  ArrayView<ChoiceState> state;
  AMHEX_HD void operator()(int64_t index) const {
    const int32_t element = list[index];
    if (first_claim[element] != static_cast<uint64_t>(element)) return;
    claims.VisitClaimed(element, [&](int32_t other) {
      if (other > element) state[other] = ChoiceState::kOut;
    });
  }
};

// Memory where bodies run.
inline int64_t ChooseInTurnBytes(int64_t count) {
  // First claims, and two lists with what counting them takes.
  return count * static_cast<int64_t>(sizeof(uint64_t) + 3 * sizeof(int32_t));
}

// The next round for those of a list that are undecided.
template <class E, class Claims>
void TakeChoiceRound(E& executor, const Claims& claims, ArrayView<const int32_t> list,
                     ArrayView<ChoiceState> state, ArrayView<uint64_t> first_claim) {
  executor.ForEach("forget claims", list.size, NoClaimBody{list, ReadOnly(state), first_claim});
  executor.ForEach("see who would claim", list.size,
                   WouldClaimBody<Claims>{claims, list, ReadOnly(state), first_claim});
  executor.ForEach("choose", list.size, ChooseBody{list, ReadOnly(first_claim), state});
  executor.ForEach("claim", list.size,
                   ClaimBody<Claims>{claims, list, ReadOnly(first_claim), state});
}

// Decides all elements that are undecided. Elements are in the order of choosing;
//   template <class Visit> AMHEX_HD void VisitClaimed(int32_t element, const Visit& visit) const;
// of `claims` calls visit(other) for those that the element claims, itself perhaps among them.
// Waits once in kRoundsPerLook rounds.
template <class E, class Claims>
void ChooseInTurn(E& executor, const Claims& claims, ArrayView<ChoiceState> state) {
  Buffer<E, uint64_t> first_claim = executor.template Alloc<uint64_t>(state.size);
  const auto undecided = [&](ArrayView<const int32_t> list, int64_t count) {
    return ListItems(executor, "list what is undecided", count,
                     UndecidedSearch{ReadOnly(state), list});
  };
  Buffer<E, int32_t> list = undecided({}, state.size);
  while (list.size() > 0 && !executor.Stopped()) {
    const ArrayView<const int32_t> view = ReadOnly(list.View());
    for (int round = 0; round < kRoundsPerLook; ++round) {
      TakeChoiceRound(executor, claims, view, state, first_claim.View());
    }
    list = undecided(view, view.size);
  }
}

}  // namespace amhex
