// What no later stage could make sense of, told to the user in terms of the input's own indices.
#pragma once

#include "absl/status/status.h"
#include "amhex/input_hull.h"

namespace amhex {

// INVALID_ARGUMENT for an empty input, non-finite or absurdly large coordinates, indices out of
// range, a wrong number of normals (naming the first offending index and how many there are), and
// for points that all lie in one plane. OUT_OF_RANGE for more elements than 32-bit indices reach.
// Linear in the input's size; allocates nothing.
absl::Status CheckInput(const InputHull& input);

}  // namespace amhex
