#include "formats/draco_guard.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "formats/byte_reader.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

constexpr std::string_view kMagic = "DRACO";
constexpr uint16_t kMetadataFlag = 0x8000;
constexpr int kMaxMetadataDepth = 16;
// Encoder types and methods of the bitstream.
constexpr uint8_t kPointCloudType = 0;
constexpr uint8_t kMeshType = 1;
constexpr uint8_t kSequentialMethod = 0;

absl::Status EndsEarly(const ByteReader& reader) {
  return absl::InvalidArgumentError(
      absl::StrCat("byte ", reader.position(), ": the Draco data end inside the header"));
}

// Little-endian groups of seven bits, the highest bit of a byte says that another follows.
bool ReadVarint(ByteReader* reader, uint64_t* value) {
  constexpr int kMaxGroups = 10;
  *value = 0;
  for (int group = 0; group < kMaxGroups; ++group) {
    uint8_t byte = 0;
    if (!reader->Read(&byte)) return false;
    *value |= static_cast<uint64_t>(byte & 0x7f) << (7 * group);
    if ((byte & 0x80) == 0) return true;
  }
  return false;
}

bool SkipName(ByteReader* reader) {
  uint8_t length = 0;
  return reader->Read(&length) && reader->Skip(length);
}

// Skips one metadata block and those inside it.
bool SkipMetadata(ByteReader* reader, int depth) {
  uint64_t entry_count = 0;
  if (depth > kMaxMetadataDepth || !ReadVarint(reader, &entry_count)) return false;
  for (uint64_t i = 0; i < entry_count; ++i) {
    uint64_t size = 0;
    if (!SkipName(reader) || !ReadVarint(reader, &size) || !reader->Skip(size)) return false;
  }
  uint64_t child_count = 0;
  if (!ReadVarint(reader, &child_count)) return false;
  for (uint64_t i = 0; i < child_count; ++i) {
    if (!SkipName(reader) || !SkipMetadata(reader, depth + 1)) return false;
  }
  return true;
}

bool SkipGeometryMetadata(ByteReader* reader) {
  uint64_t attribute_count = 0;
  if (!ReadVarint(reader, &attribute_count)) return false;
  for (uint64_t i = 0; i < attribute_count; ++i) {
    uint64_t attribute_id = 0;
    if (!ReadVarint(reader, &attribute_id) || !SkipMetadata(reader, 0)) return false;
  }
  return SkipMetadata(reader, 0);
}

bool ReadMeshCounts(ByteReader* reader, uint8_t method, int minor, uint64_t* points,
                    uint64_t* faces) {
  constexpr int kFirstMinorWithPlainCounts = 2;
  if (method == kSequentialMethod) {
    if (minor >= kFirstMinorWithPlainCounts) {
      return ReadVarint(reader, faces) && ReadVarint(reader, points);
    }
    uint32_t face_count = 0, point_count = 0;
    if (!reader->Read(&face_count) || !reader->Read(&point_count)) return false;
    *faces = face_count;
    *points = point_count;
    return true;
  }
  uint8_t traversal = 0;
  uint64_t new_vertices = 0;
  if (!reader->Read(&traversal)) return false;
  if (minor < kFirstMinorWithPlainCounts && !ReadVarint(reader, &new_vertices)) return false;
  return ReadVarint(reader, points) && ReadVarint(reader, faces);
}

absl::Status CheckLimit(const char* what, uint64_t count, size_t byte_count) {
  const int64_t limit = std::min(
      kMaxDracoElements,
      std::max(kFreeDracoElements, kMaxDracoElementsPerByte * static_cast<int64_t>(byte_count)));
  if (count <= static_cast<uint64_t>(limit)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the Draco data claim ", count, " ", what,
                                                 "; at most ", limit, " are believed of ",
                                                 byte_count, " bytes"));
}

}  // namespace

absl::StatusOr<DracoCounts> CheckDracoHeader(std::string_view bytes) {
  if (bytes.substr(0, kMagic.size()) != kMagic) {
    return absl::InvalidArgumentError("byte 0: the data do not begin with \"DRACO\"");
  }
  ByteReader reader(bytes, std::endian::little);
  uint8_t major = 0, minor = 0, type = 0, method = 0;
  uint16_t flags = 0;
  reader.Skip(kMagic.size());
  if (!reader.Read(&major) || !reader.Read(&minor) || !reader.Read(&type) ||
      !reader.Read(&method) || !reader.Read(&flags)) {
    return EndsEarly(reader);
  }
  if (major != 2) {
    return absl::InvalidArgumentError(
        absl::StrCat("Draco bitstream ", major, ".", minor, " is not read; 2.x is"));
  }
  if (type != kPointCloudType && type != kMeshType) {
    return absl::InvalidArgumentError(absl::StrCat("byte 7: unknown Draco geometry type ", type));
  }
  if ((flags & kMetadataFlag) != 0 && !SkipGeometryMetadata(&reader)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "byte ", reader.position(), ": the Draco metadata end early or nest too deeply"));
  }
  uint64_t points = 0, faces = 0;
  if (type == kPointCloudType) {
    int32_t point_count = 0;
    if (!reader.Read(&point_count)) return EndsEarly(reader);
    if (point_count < 0) {
      return absl::InvalidArgumentError(
          absl::StrCat("the Draco data claim ", point_count, " points"));
    }
    points = static_cast<uint64_t>(point_count);
  } else if (!ReadMeshCounts(&reader, method, minor, &points, &faces)) {
    return EndsEarly(reader);
  }
  AMHEX_RETURN_IF_ERROR(CheckLimit("points", points, bytes.size()));
  AMHEX_RETURN_IF_ERROR(CheckLimit("faces", faces, bytes.size()));
  DracoCounts counts;
  counts.geometry = type == kMeshType ? DracoGeometry::kMesh : DracoGeometry::kPointCloud;
  counts.point_count = static_cast<int64_t>(points);
  counts.face_count = static_cast<int64_t>(faces);
  return counts;
}

}  // namespace amhex::client
