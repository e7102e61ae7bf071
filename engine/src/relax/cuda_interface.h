// The two functions that libamhex_engine_cuda.so exports. Both sides are built from one tree by one
// compiler, so C++ types may cross; exceptions may not.
#pragma once

#include <cstddef>

#include "relax/relaxation_task.h"

namespace amhex {

enum class CudaResult : int {
  kDone = 0,
  kStopped = 1,
  kNoDevice = 2,
  kOutOfMemory = 3,
  kFailed = 4,
  kDeviceLost = 5  // this process cannot use the device any more
};

extern "C" {

// Writes one line about the device, or why there is none, into text[0 .. capacity).
using AmhexDescribeCudaFunction = CudaResult(char* text, size_t capacity);

// Runs `task` in place; on failure writes the reason.
using AmhexRelaxOnCudaFunction = CudaResult(RelaxationTask* task, char* text, size_t capacity);

}  // extern "C"

inline constexpr char kCudaLibraryName[] = "libamhex_engine_cuda.so";
inline constexpr char kDescribeCudaSymbol[] = "AmhexDescribeCuda";
inline constexpr char kRelaxOnCudaSymbol[] = "AmhexRelaxOnCuda";

}  // namespace amhex
