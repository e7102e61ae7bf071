// Sums of all elements before each, on the emulated device; called twice, as CUB is.
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

// NOLINTBEGIN(readability-identifier-naming): CUDA's names

namespace cub {

struct DeviceScan {
  template <class T>
  static cudaError_t ExclusiveSum(void* scratch, size_t& bytes, const T* values, T* sums,
                                  int64_t count, cudaStream_t stream) {
    if (scratch == nullptr) {
      constexpr int64_t kElementsPerTile = 1024, kBytesPerTile = 16;
      bytes = static_cast<size_t>((count / kElementsPerTile + 33) * kBytesPerTile);
      return cudaSuccess;
    }
    return amhex::emulated::Do([&](amhex::emulated::Device&) {
      return amhex::emulated::EnqueueInto(stream, [=] {
        T sum = 0;
        for (int64_t i = 0; i < count; ++i) {
          const T value = values[i];
          sums[i] = sum;
          sum += value;
        }
      });
    });
  }
};

}  // namespace cub
// NOLINTEND(readability-identifier-naming)
