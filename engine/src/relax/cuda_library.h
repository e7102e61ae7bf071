// The CUDA backend as seen from the engine: a shared library that is loaded when first asked for,
// so that one build of the engine runs with and without a device.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "relax/relaxation_task.h"

namespace amhex {

// One line about the device that would be used, or FAILED_PRECONDITION with the reason why none
// can be: the library was not built or not found, there is no driver, no device. Looked up once.
absl::StatusOr<std::string> DescribeCuda();

// Runs `task` in place on the device. FAILED_PRECONDITION as above, RESOURCE_EXHAUSTED (device
// memory), INTERNAL (any other device error, with its text).
absl::StatusOr<RelaxationOutcome> RelaxOnCuda(RelaxationTask& task);

}  // namespace amhex
