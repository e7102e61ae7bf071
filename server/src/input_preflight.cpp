#include "input_preflight.h"

#include <bit>
#include <cstring>
#include <string>

#include "errors.h"

namespace amhex::server {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the array encodings are read and written as they lie in memory");

constexpr int64_t kVectorBytes = 24;    // three float64
constexpr int64_t kTriangleBytes = 12;  // three int32

absl::Status Refuse(amhex::v1::ErrorReason reason, const std::string& message) {
  return MakeError(absl::StatusCode::kInvalidArgument, reason, message);
}

template <class T>
T Load(const InputBytes& input, size_t offset) {
  T value;
  std::memcpy(&value, input.data + offset, sizeof(T));
  return value;
}

std::string Exceeds(const char* what, int64_t count, int64_t limit) {
  return "the input announces " + std::to_string(count) + " " + what + "; the limit is " +
         std::to_string(limit);
}

}  // namespace

absl::StatusOr<HullArraysHeader> PreflightHullArrays(const InputBytes& input,
                                                     const Limits& limits) {
  if (input.file_size == 0) return Refuse(amhex::v1::INPUT_EMPTY, "the input has no bytes");
  if (input.size < kArraysHeaderBytes ||
      std::memcmp(input.data, kHullArraysMagic, kArraysMagicBytes) != 0) {
    return Refuse(amhex::v1::INPUT_MALFORMED, "the input does not begin with an AMHEXHUL header");
  }
  const auto version = Load<int32_t>(input, 8);
  const auto normals = Load<int32_t>(input, 12);
  HullArraysHeader header;
  header.point_count = Load<int64_t>(input, 16);
  header.triangle_count = Load<int64_t>(input, 24);
  header.has_normals = normals == 1;
  if (version != kArraysVersion || (normals != 0 && normals != 1) || header.point_count < 0 ||
      header.triangle_count < 0 || (header.has_normals && header.triangle_count > 0)) {
    return Refuse(amhex::v1::INPUT_MALFORMED, "the AMHEXHUL header holds impossible numbers");
  }
  if (header.point_count > limits.max_point_count) {
    return Refuse(amhex::v1::INPUT_TOO_LARGE,
                  Exceeds("points", header.point_count, limits.max_point_count));
  }
  if (header.triangle_count > limits.max_triangle_count) {
    return Refuse(amhex::v1::INPUT_TOO_LARGE,
                  Exceeds("triangles", header.triangle_count, limits.max_triangle_count));
  }
  if (header.point_count == 0) return Refuse(amhex::v1::INPUT_EMPTY, "the input has no points");
  const int64_t expected = kArraysHeaderBytes +
                           kVectorBytes * header.point_count * (header.has_normals ? 2 : 1) +
                           kTriangleBytes * header.triangle_count;
  if (expected != input.file_size) {
    return Refuse(amhex::v1::INPUT_MALFORMED,
                  "the AMHEXHUL header announces " + std::to_string(expected) +
                      " bytes, the input has " + std::to_string(input.file_size));
  }
  return header;
}

absl::Status PreflightInput(amhex::v1::InputEncoding encoding, const InputBytes& input,
                            const Limits& limits) {
  if (encoding == amhex::v1::INPUT_ENCODING_ARRAYS) {
    return PreflightHullArrays(input, limits).status();
  }
  const absl::Status status = PreflightDraco(input, limits).status();
  return absl::IsOutOfRange(status) ? absl::OkStatus() : status;
}

}  // namespace amhex::server
