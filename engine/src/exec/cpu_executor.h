// Runs bodies on the threads of the current oneTBB arena.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "exec/executor.h"

namespace amhex {

// An array in host memory. Elements start undefined.
template <class T>
class HostBuffer {
 public:
  HostBuffer() = default;
  explicit HostBuffer(int64_t size) : data_(new T[static_cast<size_t>(size)]), size_(size) {}

  ArrayView<T> View() { return {data_.get(), size_}; }
  ArrayView<const T> View() const { return {data_.get(), size_}; }
  int64_t size() const { return size_; }

 private:
  std::unique_ptr<T[]> data_;
  int64_t size_ = 0;
};

// One per run; thread-compatible. Throws std::bad_alloc when memory ends.
class CpuExecutor {
 public:
  template <class T>
  using BufferOf = HostBuffer<T>;

  // `should_stop` may be empty; it is polled from several threads, at least once per grain.
  explicit CpuExecutor(std::function<bool()> should_stop = {})
      : should_stop_(std::move(should_stop)) {}

  template <class T>
  HostBuffer<T> Alloc(int64_t count) {
    return HostBuffer<T>(count);
  }

  template <class T>
  void CopyIn(const T* host, int64_t count, HostBuffer<T>& buffer) {
    std::copy_n(host, count, buffer.View().data);
  }

  template <class T>
  void CopyOut(const HostBuffer<T>& buffer, int64_t count, T* host) {
    std::copy_n(buffer.View().data, count, host);
  }

  template <class T>
  void CopyOutLater(const HostBuffer<T>& buffer, int64_t count, T* host) {
    CopyOut(buffer, count, host);
  }

  template <class Body>
  void ForEach(const char* /*description*/, int64_t count, const Body& body) {
    const auto run = [&](int64_t begin, int64_t end) {
      if (PollStop()) return;
      for (int64_t index = begin; index < end; ++index) body(index);
    };
    if (count <= kGrain) {
      run(0, count);
      return;
    }
    tbb::parallel_for(
        tbb::blocked_range<int64_t>(0, count, kGrain),
        [&](const tbb::blocked_range<int64_t>& range) { run(range.begin(), range.end()); },
        tbb::simple_partitioner());
  }

  template <class Body>
  int64_t Reduce(const char* /*description*/, int64_t count, const Body& body) {
    return tbb::parallel_reduce(
        tbb::blocked_range<int64_t>(0, count, kGrain), int64_t{0},
        [&](const tbb::blocked_range<int64_t>& range, int64_t sum) {
          for (int64_t index = range.begin(); index < range.end(); ++index) sum += body(index);
          return sum;
        },
        std::plus<int64_t>());
  }

  template <class Body>
  void ForEachOf(const char* description, int64_t /*count*/, ArrayView<const int64_t> actual_count,
                 const Body& body) {
    ForEach(description, actual_count[0], body);
  }

  template <class Body>
  void ReduceInto(const char* description, int64_t count, const Body& body,
                  ArrayView<int64_t> total) {
    total[0] = Reduce(description, count, body);
  }

  void ExclusiveScan(HostBuffer<int32_t>& values, int64_t count) {
    int32_t sum = 0;
    for (int64_t index = 0; index < count; ++index) {
      const int32_t value = values.View()[index];
      values.View()[index] = sum;
      sum += value;
    }
  }

  // A template so that executors derived from this one can sort their own pairs.
  template <class Pairs>
  void SortByKey(const Pairs& pairs, int64_t count, uint32_t /*largest_key*/, Pairs& sorted) {
    packed_.resize(static_cast<size_t>(count));
    const ArrayView<const uint32_t> key = pairs.key.View();
    const ArrayView<const int32_t> id = pairs.id.View();
    ForEach("pack pairs", count, [&](int64_t i) {
      packed_[static_cast<size_t>(i)] =
          (static_cast<uint64_t>(key[i]) << 32) | static_cast<uint32_t>(i);
    });
    if (Stopped()) return;
    tbb::parallel_sort(packed_);
    ForEach("unpack pairs", count, [&](int64_t i) {
      const uint64_t pair = packed_[static_cast<size_t>(i)];
      sorted.key.View()[i] = static_cast<uint32_t>(pair >> 32);
      sorted.id.View()[i] = id[static_cast<uint32_t>(pair)];
    });
  }

  template <class Step, class Observer>
  void Repeat(int32_t count, const HostBuffer<int64_t>& state, const Step& step,
              const Observer& observer) {
    for (int32_t i = 0; i < count && !Stopped(); ++i) {
      step();
      if (!Stopped() && HasSeenEnough(observer, state.View().data)) return;
    }
  }

  void Synchronize() {}
  bool Stopped() const { return stopped_.load(std::memory_order_relaxed); }

 private:
  // Elements per task: some 5 ms of the most expensive body (a lattice tile), so that a stop is
  // seen in time, and enough of the cheapest to hide the cost of a task.
  static constexpr int64_t kGrain = 128;

  bool PollStop() {
    if (!Stopped() && should_stop_ && should_stop_()) {
      stopped_.store(true, std::memory_order_relaxed);
    }
    return Stopped();
  }

  std::vector<uint64_t> packed_;  // of the sort, kept from call to call
  std::function<bool()> should_stop_;
  std::atomic<bool> stopped_{false};
};

static_assert(Executor<CpuExecutor>);

}  // namespace amhex
