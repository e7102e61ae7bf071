// An input's bytes -> the engine's MeshingInput.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/v1/geometry.pb.h"
#include "service_limits.h"

namespace amhex::server {

// Checks the whole header first (input_preflight.h), then decodes. Only workers call this: a
// decoder that is led astray may exhaust the process's memory.
//
// INVALID_ARGUMENT with reason INPUT_MALFORMED, INPUT_EMPTY, INPUT_TOO_LARGE, INPUT_INVALID (an
// index out of range) or INPUT_DECODE_LIMIT (not enough memory). Coordinates may come back
// non-finite and lists of cells contradictory; the engine checks them.
absl::StatusOr<MeshingInput> DecodeInput(amhex::v1::InputEncoding encoding,
                                         const std::string& bytes, const Limits& limits);

}  // namespace amhex::server
