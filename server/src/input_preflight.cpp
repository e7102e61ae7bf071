#include "input_preflight.h"

#include <algorithm>
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
constexpr int64_t kGuideSampleBytes = 3 * kVectorBytes;
constexpr int64_t kGuidePlaneBytes = 2 * kVectorBytes;
constexpr int64_t kIndexBytes = 4;  // int32

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

// Beginning with a magic and a version that are known; the whole header is there.
absl::Status CheckVersion(const InputBytes& input) {
  if (input.file_size == 0) return Refuse(amhex::v1::INPUT_EMPTY, "the input has no bytes");
  if (input.size < kArraysHeaderBytes ||
      std::memcmp(input.data, kHullArraysMagic, kArraysMagicBytes) != 0) {
    return Refuse(amhex::v1::INPUT_MALFORMED, "the input does not begin with an AMHEXHUL header");
  }
  const auto version = Load<int32_t>(input, 8);
  const bool is_known = version == kArraysVersion || (version == kExtendedArraysVersion &&
                                                      input.size >= kExtendedArraysHeaderBytes);
  if (is_known) return absl::OkStatus();
  return Refuse(amhex::v1::INPUT_MALFORMED,
                "the AMHEXHUL header has version " + std::to_string(version) + " and " +
                    std::to_string(input.size) +
                    " bytes; versions 1 (32 bytes) and 2 (72) are read");
}

HullArraysHeader LoadHeader(const InputBytes& input) {
  HullArraysHeader header;
  header.has_normals = Load<int32_t>(input, 12) == 1;
  header.point_count = Load<int64_t>(input, 16);
  header.triangle_count = Load<int64_t>(input, 24);
  if (Load<int32_t>(input, 8) == kArraysVersion) return header;
  header.header_bytes = kExtendedArraysHeaderBytes;
  header.cell_count = Load<int64_t>(input, 32);
  header.face_count = Load<int64_t>(input, 40);
  header.corner_count = Load<int64_t>(input, 48);
  header.guide_sample_count = Load<int64_t>(input, 56);
  header.guide_plane_count = Load<int64_t>(input, 64);
  return header;
}

// At most one of normals, triangles and cells; faces and corners only with cells.
bool IsConsistent(const HullArraysHeader& header) {
  const int kinds = (header.has_normals ? 1 : 0) + (header.triangle_count > 0 ? 1 : 0) +
                    (header.cell_count > 0 ? 1 : 0);
  const bool has_parts = header.face_count > 0 && header.corner_count > 0;
  const bool has_no_parts = header.face_count == 0 && header.corner_count == 0;
  return kinds <= 1 && (header.cell_count > 0 ? has_parts : has_no_parts);
}

absl::Status CheckCounts(const HullArraysHeader& header, const Limits& limits, int64_t file_size) {
  struct Bound {
    const char* what;
    int64_t count, limit;
  };
  const Bound bounds[] = {
      {"points", header.point_count, limits.max_point_count},
      {"triangles", header.triangle_count, limits.max_triangle_count},
      {"cells", header.cell_count, limits.max_triangle_count},
      {"faces of cells", header.face_count, limits.max_triangle_count},
      {"guide samples", header.guide_sample_count, limits.max_point_count},
      {"guide planes", header.guide_plane_count, limits.max_point_count},
      {"corners of faces", header.corner_count, file_size},
  };
  for (const Bound& bound : bounds) {
    if (bound.count < 0) {
      return Refuse(amhex::v1::INPUT_MALFORMED, "the AMHEXHUL header holds impossible numbers");
    }
    if (bound.count > bound.limit) {
      return Refuse(amhex::v1::INPUT_TOO_LARGE, Exceeds(bound.what, bound.count, bound.limit));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<HullArraysHeader> PreflightHullArrays(const InputBytes& input,
                                                     const Limits& limits) {
  if (const absl::Status status = CheckVersion(input); !status.ok()) return status;
  const HullArraysHeader header = LoadHeader(input);
  const auto normals = Load<int32_t>(input, 12);
  if ((normals != 0 && normals != 1) || !IsConsistent(header)) {
    return Refuse(amhex::v1::INPUT_MALFORMED, "the AMHEXHUL header holds impossible numbers");
  }
  if (const absl::Status status = CheckCounts(header, limits, input.file_size); !status.ok()) {
    return status;
  }
  if (header.point_count == 0) return Refuse(amhex::v1::INPUT_EMPTY, "the input has no points");
  const int64_t expected =
      header.header_bytes + kVectorBytes * header.point_count * (header.has_normals ? 2 : 1) +
      kTriangleBytes * header.triangle_count + kGuideSampleBytes * header.guide_sample_count +
      kGuidePlaneBytes * header.guide_plane_count +
      kIndexBytes * (header.cell_count + header.face_count + header.corner_count);
  if (expected != input.file_size) {
    return Refuse(amhex::v1::INPUT_MALFORMED,
                  "the AMHEXHUL header announces " + std::to_string(expected) +
                      " bytes, the input has " + std::to_string(input.file_size));
  }
  return header;
}

absl::StatusOr<int64_t> PreflightInput(amhex::v1::InputEncoding encoding, const InputBytes& input,
                                       const Limits& limits) {
  if (encoding == amhex::v1::INPUT_ENCODING_ARRAYS) {
    const auto arrays = PreflightHullArrays(input, limits);
    if (!arrays.ok()) return arrays.status();
    return std::max({arrays->point_count, arrays->triangle_count, arrays->cell_count});
  }
  const auto draco = PreflightDraco(input, limits);
  if (absl::IsOutOfRange(draco.status())) return 0;
  if (!draco.ok()) return draco.status();
  return std::max(draco->point_count, draco->triangle_count);
}

}  // namespace amhex::server
