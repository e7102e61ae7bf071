// The seam between the method and the machine: what a stage may ask of threads or of a device.
//
// A stage is a template over an executor; a body is a small struct whose call operator handles
// one element and holds nothing but views and scalars. Nothing above this folder knows threads,
// streams or devices. Implementations: cpu_executor.h (oneTBB), cuda_executor.cuh.
#pragma once

#include <concepts>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "base/array_view.h"

namespace amhex {

// The owning array of an executor; `View()` is what bodies get. Contents start undefined.
template <class Executor, class T>
using Buffer = typename Executor::template BufferOf<T>;

// Bodies used to state the concept.
struct NoOperationBody {
  AMHEX_HD void operator()(int64_t /*index*/) const {}
};
struct IndexValueBody {
  AMHEX_HD int64_t operator()(int64_t index) const { return index; }
};

// Numbers and what they belong to, sorted together.
template <class Executor>
struct KeyedIds {
  Buffer<Executor, uint32_t> key;
  Buffer<Executor, int32_t> id;
};

// What `Repeat` is asked to do, and whom it tells.
struct NoStep {
  void operator()() const {}
};
struct NoObserver {
  void operator()(const int64_t* /*state*/) const {}
};

// Tells the observer; one that answers nothing never has enough.
template <class Observer>
bool HasSeenEnough(const Observer& observer, const int64_t* state) {
  if constexpr (std::is_void_v<decltype(observer(state))>) {
    observer(state);
    return false;
  } else {
    return observer(state);
  }
}

// Operations are ordered: each sees the results of the ones before. Every description names the
// step in profiles and error messages. Once a run should stop, remaining elements are skipped,
// `Stopped()` turns true and results are meaningless.
template <class E>
concept Executor = requires(E executor, const E const_executor, Buffer<E, int32_t>& ids,
                            KeyedIds<E>& pairs, Buffer<E, int64_t>& numbers, const int32_t* host_in,
                            int32_t* host_out, int64_t count) {
  // Memory for `count` elements where bodies run.
  { executor.template Alloc<int32_t>(count) } -> std::same_as<Buffer<E, int32_t>>;
  // Copies `count` elements from or to host memory, whose owner may do with it what it likes as
  // soon as this returns. The buffer lives at least until something has been asked of it.
  executor.CopyIn(host_in, count, ids);
  executor.CopyOut(ids, count, host_out);
  // The same, but the host has it once it has synchronized, which the buffer lives to see.
  executor.CopyOutLater(ids, count, host_out);
  // Calls the body for 0 .. count-1, in any order.
  executor.ForEach("description", count, NoOperationBody{});
  // The same for 0 .. n-1 where n, at most `count`, is read where bodies run, in its turn.
  executor.ForEachOf("description", count, ReadOnly(numbers.View()), NoOperationBody{});
  // Sum of the body over 0 .. count-1. Integers only: the order of additions must not matter.
  { executor.Reduce("description", count, IndexValueBody{}) } -> std::same_as<int64_t>;
  // The same into the first element of a view, without waiting for it.
  executor.ReduceInto("description", count, IndexValueBody{}, numbers.View());
  // In place: element i becomes the sum of the elements before it.
  executor.ExclusiveScan(ids, count);
  // Sorts the first `count` pairs by key, equal keys in their order. Every key is at most
  // `largest_key`.
  executor.SortByKey(pairs, count, uint32_t{}, pairs);
  // Takes the step `count` times. A step must not wait for its own results: from the second
  // repetition on the machine may replay what the last two calls asked for. After each the observer
  // gets a copy of the state, which may be empty, perhaps late, always in order. An observer that
  // answers true has seen enough: no more steps follow but for those that are under way.
  executor.Repeat(int32_t{}, numbers, NoStep{}, NoObserver{});
  executor.Synchronize();
  { const_executor.Stopped() } -> std::same_as<bool>;
};

}  // namespace amhex
