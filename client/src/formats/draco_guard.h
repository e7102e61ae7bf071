// Looks at a Draco file's header and counts without calling Draco.
//
// Draco 1.5.5 reserves memory for whatever counts a file claims; a file of 61 bytes can claim
// gigabytes. This refuses such files first.
#pragma once

#include <cstdint>
#include <string_view>

#include "absl/status/statusor.h"

namespace amhex::client {

enum class DracoGeometry : uint8_t { kPointCloud, kMesh };

struct DracoCounts {
  DracoGeometry geometry = DracoGeometry::kPointCloud;
  int64_t point_count = 0;  // as claimed; points or vertices
  int64_t face_count = 0;   // 0 for clouds
};

// Most points or faces a file may claim per byte of its size, and in all. The densest real files
// (planes in regular order) stay below a tenth of the first.
inline constexpr int64_t kMaxDracoElementsPerByte = 256;
inline constexpr int64_t kMaxDracoElements = 100'000'000;
// Files may always claim this many: small files have little but overhead.
inline constexpr int64_t kFreeDracoElements = 100'000;

// INVALID_ARGUMENT if the bytes are no Draco file of bitstream 2.x, end early, or claim more than
// the limits above.
absl::StatusOr<DracoCounts> CheckDracoHeader(std::string_view bytes);

}  // namespace amhex::client
