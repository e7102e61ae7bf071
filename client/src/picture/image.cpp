#include "picture/image.h"

#include <png.h>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "formats/hull_writer.h"

namespace amhex::client {

absl::StatusOr<std::string> EncodePng(const Image& image) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = 0;
  if (png_image_write_to_memory(&header, nullptr, &size, 0, image.rgb.data(), 0, nullptr) == 0) {
    return absl::InternalError(absl::StrCat("the picture cannot be encoded: ", header.message));
  }
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr) ==
      0) {
    return absl::InternalError(absl::StrCat("the picture cannot be encoded: ", header.message));
  }
  bytes.resize(size);
  return bytes;
}

absl::Status CheckPngPath(const std::string& path) {
  if (absl::EndsWithIgnoreCase(path, ".png")) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": unknown extension; pictures are written to .png"));
}

absl::Status WritePng(const Image& image, const std::string& path) {
  const absl::StatusOr<std::string> bytes = EncodePng(image);
  if (!bytes.ok()) return bytes.status();
  return WriteWholeFile(path, *bytes);
}

}  // namespace amhex::client
