// INPUT_ENCODING_ARRAYS, as laid out in proto/amhex/v1/geometry.proto.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "service_limits.h"

namespace amhex::server {

// Errors as for DecodeInput (surface_codec.h); may throw std::bad_alloc.
absl::StatusOr<MeshingInput> DecodeHullArrays(const std::string& bytes, const Limits& limits);

// For tests and callers without Draco: version 1 for surfaces and clouds without guidance, else 2.
std::string EncodeHullArrays(const MeshingInput& input);

}  // namespace amhex::server
