// The user's guidance: checked, and brought into the hull's frame.
#pragma once

#include "absl/status/status.h"
#include "amhex/input_hull.h"
#include "amhex/params.h"
#include "input/hull.h"

namespace amhex {

// INVALID_ARGUMENT for coordinates that are not finite and directions without a length (naming the
// first offender and how many there are), and for guidance with a start that knows no orientation
// field. Linear; allocates nothing.
absl::Status CheckGuidance(const Guidance& guidance, const MeshingParams& params);

// Sets `hull->guidance`. Samples outside the solid have no effect; their number becomes a warning.
void ApplyGuidance(const Guidance& guidance, Hull* hull);

}  // namespace amhex
