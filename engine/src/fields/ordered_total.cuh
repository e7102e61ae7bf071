// Adds the partial sums of a solve in their order on a CUDA device. Their order is part of the
// bits, so that one thread adds them; the others read them for it.
#pragma once

#include <cstdint>

#include "exec/cuda_executor.cuh"
#include "fields/ordered_total.h"

namespace amhex::fields {

// By each thread of the block, one sum at a time: as many as hide the way to memory behind the
// additions of the sums before.
inline constexpr int kTotalThreads = 256;

// One thread block. Two batches take turns: while the first thread adds one, the others read the
// next, and none can reach the one after that before the first thread is done.
template <class Body>
__global__ void __launch_bounds__(kTotalThreads, 1)
    DecideTogetherKernel(ArrayView<const int64_t> is_live, Body body, const int32_t* stop_flag) {
  __shared__ double batch[2][kTotalThreads];
  __shared__ int32_t goes_on;
  const int64_t thread = threadIdx.x;
  // One thread reads, so that all stay or leave.
  if (thread == 0) goes_on = is_live[0] != 0 && !IsStopSet(stop_flag) ? 1 : 0;
  __syncthreads();
  if (goes_on == 0) return;
  const int64_t block_count = body.block_count();
  double total = 0;
  int turn = 0;
  for (int64_t first = 0; first < block_count; first += kTotalThreads) {
    double* const sums = batch[turn];
    if (first + thread < block_count) sums[thread] = body.OfBlock(first + thread);
    __syncthreads();
    const int64_t left = Smaller(int64_t{kTotalThreads}, block_count - first);
    for (int64_t i = 0; thread == 0 && i < left; ++i) total += sums[i];
    turn ^= 1;
  }
  if (thread == 0) body.Decide(total);
}

template <>
struct OrderedTotal<CudaExecutor> {
  template <class Body>
  static void Decide(CudaExecutor& executor, const char* description,
                     ArrayView<const int64_t> is_live, const Body& body) {
    if (!executor.MayLaunch()) return;
    executor.Launch(description, DecideTogetherKernel<Body>, 1, kTotalThreads, is_live, body,
                    executor.stop_flag());
  }
};

}  // namespace amhex::fields
