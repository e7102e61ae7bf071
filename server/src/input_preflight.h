// Checks an input's header, whatever its encoding.
#pragma once

#include "absl/status/status.h"
#include "amhex/v1/geometry.pb.h"
#include "draco_preflight.h"

namespace amhex::server {

// The fixed part of INPUT_ENCODING_ARRAYS, see geometry.proto.
inline constexpr char kHullArraysMagic[] = "AMHEXHUL";
inline constexpr int kArraysMagicBytes = 8;
inline constexpr int32_t kArraysVersion = 1;          // surfaces and clouds
inline constexpr int32_t kExtendedArraysVersion = 2;  // besides, cells and guidance
inline constexpr int kArraysHeaderBytes = 32;
inline constexpr int kExtendedArraysHeaderBytes = 72;

struct HullArraysHeader {
  int header_bytes = kArraysHeaderBytes;
  bool has_normals = false;
  int64_t point_count = 0;
  int64_t triangle_count = 0;
  // Version 2 only.
  int64_t cell_count = 0;
  int64_t face_count = 0;
  int64_t corner_count = 0;
  int64_t guide_sample_count = 0;
  int64_t guide_plane_count = 0;
};

// INVALID_ARGUMENT with reason INPUT_MALFORMED, INPUT_EMPTY or INPUT_TOO_LARGE.
absl::StatusOr<HullArraysHeader> PreflightHullArrays(const InputBytes& input, const Limits& limits);

// The triangles, points or cells that the header announces; 0 when only the beginning is at hand
// and does not tell. The worker checks the whole file.
absl::StatusOr<int64_t> PreflightInput(amhex::v1::InputEncoding encoding, const InputBytes& input,
                                       const Limits& limits);

}  // namespace amhex::server
