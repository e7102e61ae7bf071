// Sums on the emulated device; called twice, as CUB is.
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

// NOLINTBEGIN(readability-identifier-naming): CUDA's names

namespace cuda::std {

template <class T = void>
struct plus {};

}  // namespace cuda::std

namespace cub {

struct DeviceReduce {
  static constexpr size_t kScratchBytes = 16384;

  template <class Values, class T>
  static cudaError_t Reduce(void* scratch, size_t& bytes, Values values, T* total, int64_t count,
                            ::cuda::std::plus<> /*add*/, T start, cudaStream_t stream) {
    if (scratch == nullptr) {
      bytes = kScratchBytes;
      return cudaSuccess;
    }
    return amhex::emulated::Do([&](amhex::emulated::Device&) {
      return amhex::emulated::EnqueueInto(stream, [=] {
        T sum = start;
        for (int64_t i = 0; i < count; ++i) sum += values[i];
        *total = sum;
      });
    });
  }
};

}  // namespace cub
// NOLINTEND(readability-identifier-naming)
