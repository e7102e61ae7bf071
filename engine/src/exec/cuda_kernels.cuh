// What every body runs in on a device.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>

#include "base/array_view.h"

namespace amhex {

// Set from the host while kernels run; read past the caches so that every block sees it.
__device__ inline bool IsStopSet(const int32_t* stop_flag) {
  return *static_cast<const volatile int32_t*>(stop_flag) != 0;
}

// One thread per element.
template <class Body>
__global__ void ForEachKernel(int64_t count, Body body, const int32_t* stop_flag) {
  const int64_t index = static_cast<int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (index < count && !IsStopSet(stop_flag)) body(index);
}

template <class Body>
__global__ void ForEachOfKernel(ArrayView<const int64_t> count, Body body,
                                const int32_t* stop_flag) {
  const int64_t index = static_cast<int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (index < count[0] && !IsStopSet(stop_flag)) body(index);
}

// A report of how far things are, the next one of a ring in memory that the host reads, too.
static __global__ void ReportStateKernel(ArrayView<const int64_t> state, int64_t reports_kept,
                                         int64_t* reports_made, int64_t* reports) {
  int64_t* const report = reports + reports_made[0]++ % reports_kept * state.size;
  for (int64_t i = 0; i < state.size; ++i) report[i] = state[i];
}

}  // namespace amhex
