// Visits of vertices on a CUDA device: a team of threads for each, since a colour has too few
// vertices to fill a device, and the slowest visit is how long a colour takes.
#pragma once

#include <cstdint>

#include "exec/cuda_executor.cuh"
#include "exec/team.cuh"
#include "optimize/colour_visits.h"
#include "optimize/team_cells.cuh"

namespace amhex {

inline constexpr int kVisitThreads = 64;

template <class Body>
__global__ void __launch_bounds__(kVisitThreads, 4)
    VisitTogetherKernel(ArrayView<const int64_t> count, Body body, const int32_t* stop_flag) {
  const Team team;
  const int64_t thread = static_cast<int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  const int64_t i = thread / Team::kWidth;
  // One thread reads, so that all stay or leave.
  const int goes_on = team.rank() == 0 && i < count[0] && !IsStopSet(stop_flag) ? 1 : 0;
  if (team.From(0, goes_on) != 0) body.template Visit<TeamCells>(i);
}

template <>
struct ColourVisits<CudaExecutor> {
  template <class Body>
  static void Run(CudaExecutor& executor, const char* description, int64_t count,
                  ArrayView<const int64_t> actual_count, const Body& body) {
    if (count == 0 || !executor.MayLaunch()) return;
    constexpr int64_t kVerticesPerBlock = kVisitThreads / Team::kWidth;
    executor.Launch(description, VisitTogetherKernel<Body>,
                    (count + kVerticesPerBlock - 1) / kVerticesPerBlock, kVisitThreads,
                    actual_count, body, executor.stop_flag());
  }
};

}  // namespace amhex
