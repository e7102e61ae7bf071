// A picture in memory and its PNG file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace amhex::client {

struct Image {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;  // [height][width][3], top row first

  const uint8_t* Pixel(int x, int y) const {
    return &rgb[3 * (size_t(y) * size_t(width) + size_t(x))];
  }
};

// The bytes of a PNG file. INTERNAL if libpng fails.
absl::StatusOr<std::string> EncodePng(const Image& image);

// INVALID_ARGUMENT for a path that does not end as those of PNG files do.
absl::Status CheckPngPath(const std::string& path);

// Writes the file whole or not at all; errors name the path.
absl::Status WritePng(const Image& image, const std::string& path);

}  // namespace amhex::client
