// The sampling of sample_hull.h with arrays where bodies run.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "base/ordered_bits.h"
#include "exec/choose_in_turn.h"
#include "exec/counted_list.h"
#include "exec/executor.h"
#include "exec/uploaded_arrays.h"
#include "fields/point_rows_impl.h"
#include "input/hull_batch_impl.h"
#include "input/sample_task.h"

namespace amhex {

struct PutCandidateBody {
  SampledSurface surface;
  ArrayView<Vec3d> position;
  ArrayView<int32_t> triangle;
  AMHEX_HD void operator()(int64_t i) const {
    const SampleCandidate candidate = CandidateOf(surface, i);
    position[i] = candidate.position;
    triangle[i] = candidate.triangle;
  }
};

// By 32 bits of the order of turns.
struct KeyByTurnBody {
  ArrayView<const int32_t> order;  // empty: as they come
  int shift = 0;
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;
  AMHEX_HD void operator()(int64_t i) const {
    id[i] = order.empty() ? static_cast<int32_t>(i) : order[i];
    key[i] = static_cast<uint32_t>(OrderedBits(TurnOfCandidate(id[i])) >> shift);
  }
};

struct TakeTurnBody {
  ArrayView<const int32_t> by_turn;
  ArrayView<int32_t> turn;  // [candidate]
  ArrayView<ChoiceState> state;
  AMHEX_HD void operator()(int64_t t) const {
    turn[by_turn[t]] = static_cast<int32_t>(t);
    state[t] = ChoiceState::kUndecided;
  }
};

struct CandidateClaims {
  CandidateView candidates;
  ArrayView<const int32_t> by_turn, turn;
  template <class Visit>
  AMHEX_HD void VisitClaimed(int32_t t, const Visit& visit) const {
    candidates.VisitCovered(by_turn[t], [&](int32_t j) { visit(turn[j]); });
  }
};

struct ChosenCandidateSearch {
  using Item = int32_t;
  ArrayView<const int32_t> turn;
  ArrayView<const ChoiceState> state;
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t i, const Visit& visit) const {
    if (state[turn[i]] == ChoiceState::kChosen) visit(static_cast<int32_t>(i));
  }
};

struct PutSampleBody {
  CandidateView candidates;
  ArrayView<const int32_t> chosen;
  ArrayView<HullSample> samples;
  AMHEX_HD void operator()(int64_t k) const { samples[k] = candidates.SampleAt(chosen[k]); }
};

template <class E>
class HullSampling {
 public:
  HullSampling(E& executor, SampleTask& task)
      : executor_(executor), task_(task), arrays_(executor) {}

  // Memory where bodies run.
  static int64_t Bytes(const SampleTask& task) {
    const int64_t count = task.candidate_count;
    constexpr int64_t kOfCandidate = sizeof(Vec3d) + sizeof(int32_t);
    constexpr int64_t kOfTurn = 2 * sizeof(int32_t) + sizeof(ChoiceState);
    return ResidentHullBytes<E>(task.surface.hull, *task.resident) +
           UploadedArrays<E>::Bytes(task.surface) +
           task.surface.triangle_count() * static_cast<int64_t>(sizeof(int32_t)) +
           kOfCandidate * count + E::SortBytes(count) + fields::RowsBytes(count, task.rows) +
           fields::RowsBytes(task.surface.sharp_position.size, task.sharp_rows) +
           Larger(fields::RowsScratchBytes(count), kOfTurn * count + ChooseInTurnBytes(count));
  }

  // False if it was stopped.
  bool Run() {
    const int64_t count = task_.candidate_count;
    TakeSurface();
    Buffer<E, Vec3d> position = executor_.template Alloc<Vec3d>(count);
    Buffer<E, int32_t> triangle = executor_.template Alloc<int32_t>(count);
    executor_.ForEach("spread candidates", count,
                      PutCandidateBody{view_.surface, position.View(), triangle.View()});
    view_.position = ReadOnly(position.View()), view_.triangle = ReadOnly(triangle.View());
    fields::BuiltRows<E> rows = fields::BuildRows(executor_, task_.rows, view_.position);
    fields::BuiltRows<E> sharp_rows =
        fields::BuildRows(executor_, task_.sharp_rows, view_.surface.sharp_position);
    view_.rows = rows.View(), view_.sharp_rows = sharp_rows.View();
    const Buffer<E, int32_t> chosen = Choose(OrderTurns());
    if (executor_.Stopped()) return false;
    return TakeSamples(chosen);
  }

 private:
  void TakeSurface() {
    SampledSurface& surface = view_.surface = arrays_.Upload(task_.surface);
    surface.hull = ResidentHull<E>(task_.surface.hull, *task_.resident);
    const auto place = arrays_.template AddArray<int32_t>(surface.triangle_count());
    executor_.ForEach("place triangles", surface.hull.original.size,
                      PlaceInHullBody{surface.hull.original, place});
    executor_.ForEach("place flat triangles", surface.flat.size,
                      PlaceFlatBody{surface.flat, place});
    surface.place = ReadOnly(place);
  }

  Buffer<E, int32_t> OrderTurns() {
    constexpr int kKeyBits = 32;
    const int64_t count = task_.candidate_count;
    KeyedIds<E> pairs{executor_.template Alloc<uint32_t>(count),
                      executor_.template Alloc<int32_t>(count)};
    KeyedIds<E> sorted{executor_.template Alloc<uint32_t>(count),
                       executor_.template Alloc<int32_t>(count)};
    executor_.ForEach("key candidates by turn", count,
                      KeyByTurnBody{{}, 0, pairs.key.View(), pairs.id.View()});
    executor_.SortByKey(pairs, count, ~uint32_t{0}, sorted);
    executor_.ForEach(
        "key candidates by turn", count,
        KeyByTurnBody{ReadOnly(sorted.id.View()), kKeyBits, pairs.key.View(), pairs.id.View()});
    executor_.SortByKey(pairs, count, ~uint32_t{0}, sorted);
    return std::move(sorted.id);
  }

  Buffer<E, int32_t> Choose(const Buffer<E, int32_t>& by_turn) {
    const int64_t count = by_turn.size();
    Buffer<E, int32_t> turn = executor_.template Alloc<int32_t>(count);
    Buffer<E, ChoiceState> state = executor_.template Alloc<ChoiceState>(count);
    executor_.ForEach("take turns", count, TakeTurnBody{by_turn.View(), turn.View(), state.View()});
    ChooseInTurn(executor_, CandidateClaims{view_, by_turn.View(), ReadOnly(turn.View())},
                 state.View());
    return ListItems(executor_, "list samples", count,
                     ChosenCandidateSearch{ReadOnly(turn.View()), ReadOnly(state.View())});
  }

  bool TakeSamples(const Buffer<E, int32_t>& chosen) {
    const int64_t count = chosen.size();
    Buffer<E, HullSample> found = executor_.template Alloc<HullSample>(count);
    executor_.ForEach("find the samples' frames", count,
                      PutSampleBody{view_, chosen.View(), found.View()});
    std::vector<HullSample> samples(static_cast<size_t>(count));
    executor_.CopyOut(found, count, samples.data());
    if (executor_.Stopped()) return false;
    task_.samples = std::move(samples);
    return true;
  }

  E& executor_;
  SampleTask& task_;
  UploadedArrays<E> arrays_;
  CandidateView view_;
};

}  // namespace amhex
