// Reads the counts in an input's header before any decoder sees the bytes.
//
// Draco's decoder reserves memory for whatever counts a file announces: a file of 61 bytes makes
// release 1.5.5 ask for 10 GB. This parser reads the header, skips the metadata, and compares the
// counts with the limits and with what the file's size can hold.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "service_limits.h"

namespace amhex::server {

struct DracoHeader {
  bool is_mesh = false;
  int64_t point_count = 0;
  int64_t triangle_count = 0;   // 0 for point clouds
  int64_t attribute_count = 0;  // 0 where the header does not tell (meshes)
};

// The bytes at hand: all of the file, or its beginning.
struct InputBytes {
  const uint8_t* data = nullptr;
  size_t size = 0;
  int64_t file_size = 0;  // >= size
};

// INVALID_ARGUMENT with reason INPUT_MALFORMED, INPUT_EMPTY or INPUT_TOO_LARGE. When only the
// beginning is at hand and the counts lie beyond it, the answer is OUT_OF_RANGE. Linear in the
// size of the metadata; allocates nothing that depends on the input.
absl::StatusOr<DracoHeader> PreflightDraco(const InputBytes& input, const Limits& limits);

}  // namespace amhex::server
