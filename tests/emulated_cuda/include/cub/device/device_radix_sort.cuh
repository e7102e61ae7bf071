// Stable sorting by some bits of the keys on the emulated device; called twice, as CUB is.
#pragma once

#include <cuda_runtime.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

// NOLINTBEGIN(readability-identifier-naming): CUDA's names

namespace cub {

struct DeviceRadixSort {
  // Scratch: a second copy of both arrays and the digits' counters, as CUB's takes.
  template <class Key, class Value>
  static cudaError_t SortPairs(void* scratch, size_t& bytes, const Key* keys, Key* sorted_keys,
                               const Value* values, Value* sorted_values, int64_t count,
                               int first_bit, int end_bit, cudaStream_t stream = nullptr) {
    if (scratch == nullptr) {
      constexpr size_t kCounterBytes = 65536;
      bytes = static_cast<size_t>(count) * (sizeof(Key) + sizeof(Value)) + kCounterBytes;
      return cudaSuccess;
    }
    return amhex::emulated::Do([&](amhex::emulated::Device&) {
      return amhex::emulated::EnqueueInto(stream, [=] {
        const auto digits = [=](int64_t i) {
          const uint64_t below = (uint64_t{1} << end_bit) - 1;
          return (static_cast<uint64_t>(keys[i]) & below) >> first_bit;
        };
        std::vector<int64_t> order(static_cast<size_t>(count));
        for (int64_t i = 0; i < count; ++i) order[static_cast<size_t>(i)] = i;
        std::stable_sort(order.begin(), order.end(),
                         [&](int64_t a, int64_t b) { return digits(a) < digits(b); });
        for (int64_t i = 0; i < count; ++i) {
          sorted_keys[i] = keys[order[static_cast<size_t>(i)]];
          sorted_values[i] = values[order[static_cast<size_t>(i)]];
        }
      });
    });
  }
};

}  // namespace cub
// NOLINTEND(readability-identifier-naming)
