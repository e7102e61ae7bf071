// The CUDA backend as seen from the engine: a shared library that is loaded when first asked for,
// so that one build of the engine runs with and without a device.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "cuda/cuda_interface.h"

namespace amhex {

// One line about the device that would be used, or FAILED_PRECONDITION with the reason why none
// can be: the library was not built or not found, there is no driver, no device. Looked up once.
absl::StatusOr<std::string> DescribeCuda();

// Memory of that device in bytes, as a whole; 0 without one.
int64_t CudaMemoryBytes();

// Runs `task` in place on the device; false if it was stopped. FAILED_PRECONDITION as above,
// RESOURCE_EXHAUSTED (device memory, told with numbers), INTERNAL (any other device error, with its
// text). Whatever is not done leaves the task as it was.
absl::StatusOr<bool> RunOnCuda(const CudaTask& task);

}  // namespace amhex
