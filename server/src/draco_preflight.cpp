#include "draco_preflight.h"

#include <cstring>
#include <string>

#include "errors.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

constexpr char kMagic[] = "DRACO";
constexpr size_t kMagicBytes = 5;
constexpr uint8_t kPointCloudType = 0;
constexpr uint8_t kMeshType = 1;
constexpr uint8_t kMeshSequential = 0;
constexpr uint8_t kKdTreePointCloud = 1;
constexpr uint8_t kMeshEdgebreaker = 1;
constexpr uint8_t kMaxPointCloudMethod = 1;  // 0 sequential, 1 kd-tree
constexpr uint16_t kMetadataFlag = 0x8000;
// Our bounds on metadata, which we ignore: Draco itself permits 1000 levels.
constexpr int kMaxMetadataDepth = 16;
constexpr int64_t kMaxMetadataBlocks = 10'000;
// No useful file packs more elements into a byte; below the floor the ratio does not matter.
constexpr int64_t kMaxElementsPerByte = 256;
constexpr int64_t kRatioFloor = 65'536;

absl::Status Malformed(const std::string& what) {
  return MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::INPUT_MALFORMED,
                   "the Draco input is damaged or no Draco file: " + what);
}

absl::Status TooLarge(const std::string& what) {
  return MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::INPUT_TOO_LARGE, what);
}

class Reader {
 public:
  explicit Reader(const InputBytes& input) : input_(input) {}

  absl::StatusOr<uint8_t> Byte() {
    AMHEX_RETURN_IF_ERROR(Need(1));
    return input_.data[position_++];
  }

  absl::StatusOr<uint32_t> Fixed(int byte_count) {
    AMHEX_RETURN_IF_ERROR(Need(byte_count));
    uint32_t value = 0;
    for (int i = 0; i < byte_count; ++i) {
      value |= static_cast<uint32_t>(input_.data[position_++]) << (8 * i);
    }
    return value;
  }

  // Unsigned LEB128, at most 32 bits.
  absl::StatusOr<uint32_t> Varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      AMHEX_ASSIGN_OR_RETURN(const uint8_t byte, Byte());
      value |= static_cast<uint64_t>(byte & 0x7f) << shift;
      if ((byte & 0x80) == 0) {
        if (value > UINT32_MAX) break;
        return static_cast<uint32_t>(value);
      }
    }
    return Malformed("a number has too many bytes");
  }

  absl::Status Skip(int64_t byte_count) {
    AMHEX_RETURN_IF_ERROR(Need(byte_count));
    position_ += static_cast<size_t>(byte_count);
    return absl::OkStatus();
  }

 private:
  absl::Status Need(int64_t byte_count) const {
    const int64_t end = static_cast<int64_t>(position_) + byte_count;
    if (end > input_.file_size) return Malformed("it ends inside its header");
    if (end > static_cast<int64_t>(input_.size)) {
      return absl::OutOfRangeError("the header goes on beyond the bytes at hand");
    }
    return absl::OkStatus();
  }

  const InputBytes input_;
  size_t position_ = 0;
};

struct FileHeader {
  int version = 0;  // 256 * major + minor
  uint8_t type = 0;
  uint8_t method = 0;
  uint16_t flags = 0;
};

constexpr int Version(int major, int minor) { return 256 * major + minor; }

absl::StatusOr<FileHeader> ReadFileHeader(const InputBytes& input, Reader* reader) {
  if (input.size < kMagicBytes || std::memcmp(input.data, kMagic, kMagicBytes) != 0) {
    return Malformed("it does not begin with the letters DRACO");
  }
  AMHEX_RETURN_IF_ERROR(reader->Skip(kMagicBytes));
  FileHeader header;
  AMHEX_ASSIGN_OR_RETURN(const uint8_t major, reader->Byte());
  AMHEX_ASSIGN_OR_RETURN(const uint8_t minor, reader->Byte());
  AMHEX_ASSIGN_OR_RETURN(header.type, reader->Byte());
  AMHEX_ASSIGN_OR_RETURN(header.method, reader->Byte());
  AMHEX_ASSIGN_OR_RETURN(const uint32_t flags, reader->Fixed(2));
  header.version = Version(major, minor);
  header.flags = static_cast<uint16_t>(flags);
  if (header.type != kPointCloudType && header.type != kMeshType) {
    return Malformed("it holds neither a point cloud nor a mesh");
  }
  const int newest = header.type == kMeshType ? Version(2, 2) : Version(2, 3);
  if (header.version < Version(1, 1) || header.version > newest) {
    return Malformed("its version " + std::to_string(major) + "." + std::to_string(minor) +
                     " is not known");
  }
  return header;
}

// Skips one metadata block and the blocks nested in it.
absl::Status SkipMetadata(Reader* reader, int depth, int64_t* blocks_left) {
  if (depth > kMaxMetadataDepth) return Malformed("its metadata is nested too deeply");
  if (--*blocks_left < 0) return Malformed("it has too much metadata");
  AMHEX_ASSIGN_OR_RETURN(const uint32_t entry_count, reader->Varint());
  for (uint32_t i = 0; i < entry_count; ++i) {
    AMHEX_ASSIGN_OR_RETURN(const uint8_t name_size, reader->Byte());
    AMHEX_RETURN_IF_ERROR(reader->Skip(name_size));
    AMHEX_ASSIGN_OR_RETURN(const uint32_t value_size, reader->Varint());
    AMHEX_RETURN_IF_ERROR(reader->Skip(value_size));
  }
  AMHEX_ASSIGN_OR_RETURN(const uint32_t child_count, reader->Varint());
  for (uint32_t i = 0; i < child_count; ++i) {
    AMHEX_ASSIGN_OR_RETURN(const uint8_t name_size, reader->Byte());
    AMHEX_RETURN_IF_ERROR(reader->Skip(name_size));
    AMHEX_RETURN_IF_ERROR(SkipMetadata(reader, depth + 1, blocks_left));
  }
  return absl::OkStatus();
}

absl::Status SkipAllMetadata(Reader* reader) {
  int64_t blocks_left = kMaxMetadataBlocks;
  AMHEX_ASSIGN_OR_RETURN(const uint32_t attribute_count, reader->Varint());
  for (uint32_t i = 0; i < attribute_count; ++i) {
    AMHEX_RETURN_IF_ERROR(reader->Varint().status());
    AMHEX_RETURN_IF_ERROR(SkipMetadata(reader, 0, &blocks_left));
  }
  return SkipMetadata(reader, 0, &blocks_left);
}

absl::StatusOr<uint32_t> Count(const FileHeader& file, int varint_since, Reader* reader) {
  if (file.version >= varint_since) return reader->Varint();
  return reader->Fixed(4);
}

absl::StatusOr<DracoHeader> ReadPointCloud(const FileHeader& file, Reader* reader) {
  if (file.method > kMaxPointCloudMethod) return Malformed("its method is not known");
  // Before this version the tree's own number of points, which nothing bounds, decides how much
  // memory the decoder takes.
  if (file.method == kKdTreePointCloud && file.version < Version(2, 3)) {
    return Malformed("it is a kd-tree of points from before version 2.3; encode it anew");
  }
  DracoHeader header;
  AMHEX_ASSIGN_OR_RETURN(const uint32_t point_count, reader->Fixed(4));
  if (point_count > INT32_MAX) return Malformed("its number of points is negative");
  header.point_count = point_count;
  AMHEX_ASSIGN_OR_RETURN(const uint8_t decoder_count, reader->Byte());
  if (file.method != 0 || decoder_count == 0) return header;
  // The first attribute decoder's list follows; that is where files announce absurd numbers.
  AMHEX_ASSIGN_OR_RETURN(const uint32_t attributes, Count(file, Version(2, 0), reader));
  header.attribute_count = attributes;
  return header;
}

absl::StatusOr<DracoHeader> ReadSequentialMesh(const FileHeader& file, Reader* reader) {
  DracoHeader header;
  header.is_mesh = true;
  AMHEX_ASSIGN_OR_RETURN(header.triangle_count, Count(file, Version(2, 2), reader));
  AMHEX_ASSIGN_OR_RETURN(header.point_count, Count(file, Version(2, 2), reader));
  return header;
}

absl::StatusOr<DracoHeader> ReadEdgebreakerMesh(const FileHeader& file, Reader* reader) {
  DracoHeader header;
  header.is_mesh = true;
  AMHEX_RETURN_IF_ERROR(reader->Skip(1));  // the traversal's kind
  if (file.version < Version(2, 2)) {
    AMHEX_RETURN_IF_ERROR(Count(file, Version(2, 0), reader).status());  // new vertices
  }
  AMHEX_ASSIGN_OR_RETURN(header.point_count, Count(file, Version(2, 0), reader));
  AMHEX_ASSIGN_OR_RETURN(header.triangle_count, Count(file, Version(2, 0), reader));
  AMHEX_RETURN_IF_ERROR(reader->Skip(1));  // attribute data count
  AMHEX_ASSIGN_OR_RETURN(const uint32_t symbols, Count(file, Version(2, 0), reader));
  AMHEX_ASSIGN_OR_RETURN(const uint32_t splits, Count(file, Version(2, 0), reader));
  const int64_t faces = header.triangle_count;
  if (symbols > faces || faces > int64_t{symbols} + symbols / 3 || splits > symbols) {
    return Malformed("its numbers of triangles and symbols contradict each other");
  }
  if (header.point_count > 3 * faces) {
    return Malformed("it has more vertices than its triangles have corners");
  }
  return header;
}

absl::StatusOr<DracoHeader> ReadCounts(const FileHeader& file, Reader* reader) {
  if (file.type == kPointCloudType) return ReadPointCloud(file, reader);
  if (file.method == kMeshSequential) return ReadSequentialMesh(file, reader);
  if (file.method == kMeshEdgebreaker) return ReadEdgebreakerMesh(file, reader);
  return Malformed("its method is not known");
}

absl::Status CheckCount(const char* what, int64_t count, int64_t limit, int64_t file_size) {
  if (count > limit) {
    return TooLarge("the input announces " + std::to_string(count) + " " + what +
                    "; the limit is " + std::to_string(limit));
  }
  if (count > kRatioFloor && count / kMaxElementsPerByte > file_size) {
    return TooLarge("the input announces " + std::to_string(count) + " " + what + ", which its " +
                    std::to_string(file_size) + " bytes cannot hold");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DracoHeader> PreflightDraco(const InputBytes& input, const Limits& limits) {
  if (input.file_size == 0) {
    return MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::INPUT_EMPTY,
                     "the input has no bytes");
  }
  Reader reader(input);
  AMHEX_ASSIGN_OR_RETURN(const FileHeader file, ReadFileHeader(input, &reader));
  if ((file.flags & kMetadataFlag) != 0 && file.version >= Version(1, 3)) {
    AMHEX_RETURN_IF_ERROR(SkipAllMetadata(&reader));
  }
  AMHEX_ASSIGN_OR_RETURN(const DracoHeader header, ReadCounts(file, &reader));
  AMHEX_RETURN_IF_ERROR(
      CheckCount("points", header.point_count, limits.max_point_count, input.file_size));
  AMHEX_RETURN_IF_ERROR(
      CheckCount("triangles", header.triangle_count, limits.max_triangle_count, input.file_size));
  AMHEX_RETURN_IF_ERROR(CheckCount("attributes", header.attribute_count, limits.max_attribute_count,
                                   input.file_size));
  if (header.point_count == 0 || (header.is_mesh && header.triangle_count == 0)) {
    return MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::INPUT_EMPTY,
                     header.point_count == 0 ? "the input has no points"
                                             : "the input is a mesh without triangles");
  }
  return header;
}

}  // namespace amhex::server
