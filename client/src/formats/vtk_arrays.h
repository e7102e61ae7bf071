// VTK's binary data arrays: zlib blocks behind a table of sizes, in base64.
#pragma once

#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace amhex::client {

// Bytes per compressed block; VTK's default.
inline constexpr size_t kVtkBlockBytes = 32768;

// `raw` as the text of <DataArray format="binary"> with header_type="UInt64" and
// compressor="vtkZLibDataCompressor".
std::string EncodeVtkArray(std::string_view raw);

// The reverse. Never returns more than `most_bytes`. INVALID_ARGUMENT if the text is not base64, a
// size in the table is impossible, or a block does not inflate to its size.
absl::StatusOr<std::string> DecodeVtkArray(std::string_view text, size_t most_bytes);

template <class T>
std::string EncodeVtkNumbers(const std::vector<T>& numbers) {
  return EncodeVtkArray(
      {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)});
}

}  // namespace amhex::client
