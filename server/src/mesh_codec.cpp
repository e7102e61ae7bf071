#include "mesh_codec.h"

#include <fcntl.h>

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <vector>

#include "files.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

constexpr char kMagic[] = "AMHEXVOL";
constexpr size_t kMagicBytes = 8;
constexpr int32_t kVersion = 1;
constexpr int64_t kHeaderBytes = 32;

static_assert(sizeof(Vec3d) == 24 && sizeof(CellCorners) == 32 && sizeof(PrimitiveType) == 1);

std::string EncodeHeader(const AtMostHexaMesh& mesh) {
  std::string header(kMagic, kMagicBytes);
  const int32_t words[2] = {kVersion, 0};
  const int64_t counts[2] = {static_cast<int64_t>(mesh.vertices.size()),
                             static_cast<int64_t>(mesh.corners.size())};
  header.append(reinterpret_cast<const char*>(words), sizeof(words));
  header.append(reinterpret_cast<const char*>(counts), sizeof(counts));
  return header;
}

template <class T>
absl::Status WriteArray(int fd, const std::vector<T>& values, int64_t* offset) {
  static_assert(std::is_trivially_copyable_v<T>);
  const size_t size = values.size() * sizeof(T);
  AMHEX_RETURN_IF_ERROR(WriteAllAt(fd, values.data(), size, *offset));
  *offset += static_cast<int64_t>(size);
  return absl::OkStatus();
}

template <class T>
void TakeArray(const std::string& bytes, int64_t count, size_t* offset, std::vector<T>* values) {
  values->resize(static_cast<size_t>(count));
  if (count > 0) std::memcpy(values->data(), bytes.data() + *offset, values->size() * sizeof(T));
  *offset += values->size() * sizeof(T);
}

int64_t ExpectedBytes(int64_t vertex_count, int64_t cell_count) {
  constexpr int64_t kVertexBytes = 24;
  constexpr int64_t kCellBytes = 32 + 4 + 1;
  return kHeaderBytes + kVertexBytes * vertex_count + kCellBytes * cell_count;
}

bool IsKnownType(PrimitiveType type) {
  return std::find(kPrimitiveTypes.begin(), kPrimitiveTypes.end(), type) != kPrimitiveTypes.end();
}

}  // namespace

int64_t EncodedMeshBytes(const AtMostHexaMesh& mesh) {
  return ExpectedBytes(static_cast<int64_t>(mesh.vertices.size()),
                       static_cast<int64_t>(mesh.corners.size()));
}

absl::Status WriteMeshFile(const AtMostHexaMesh& mesh, const std::string& path) {
  AMHEX_ASSIGN_OR_RETURN(const UniqueFd fd, OpenFile(path, O_WRONLY | O_CREAT | O_TRUNC));
  const std::string header = EncodeHeader(mesh);
  AMHEX_RETURN_IF_ERROR(WriteAllAt(fd.get(), header.data(), header.size(), 0));
  int64_t offset = kHeaderBytes;
  AMHEX_RETURN_IF_ERROR(WriteArray(fd.get(), mesh.vertices, &offset));
  AMHEX_RETURN_IF_ERROR(WriteArray(fd.get(), mesh.corners, &offset));
  AMHEX_RETURN_IF_ERROR(WriteArray(fd.get(), mesh.quality, &offset));
  return WriteArray(fd.get(), mesh.types, &offset);
}

absl::StatusOr<AtMostHexaMesh> DecodeMesh(const std::string& bytes) {
  int32_t words[2] = {0, 0};
  int64_t counts[2] = {0, 0};
  if (bytes.size() < static_cast<size_t>(kHeaderBytes) ||
      bytes.compare(0, kMagicBytes, kMagic, kMagicBytes) != 0) {
    return absl::InvalidArgumentError("the bytes do not begin with an AMHEXVOL header");
  }
  std::memcpy(words, bytes.data() + kMagicBytes, sizeof(words));
  std::memcpy(counts, bytes.data() + kMagicBytes + sizeof(words), sizeof(counts));
  const auto size = static_cast<int64_t>(bytes.size());
  if (words[0] != kVersion || counts[0] < 0 || counts[1] < 0 || counts[0] > size ||
      counts[1] > size || ExpectedBytes(counts[0], counts[1]) != size) {
    return absl::InvalidArgumentError("the AMHEXVOL header does not fit the number of bytes");
  }
  AtMostHexaMesh mesh;
  size_t offset = kHeaderBytes;
  TakeArray(bytes, counts[0], &offset, &mesh.vertices);
  TakeArray(bytes, counts[1], &offset, &mesh.corners);
  TakeArray(bytes, counts[1], &offset, &mesh.quality);
  TakeArray(bytes, counts[1], &offset, &mesh.types);
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    const auto& corners = mesh.corners[cell];
    const bool in_range = std::all_of(corners.begin(), corners.end(), [&counts](int32_t vertex) {
      return vertex >= 0 && vertex < counts[0];
    });
    if (!in_range || !IsKnownType(mesh.types[cell])) {
      return absl::InvalidArgumentError("cell " + std::to_string(cell) +
                                        " has a bad corner or an unknown type");
    }
  }
  return mesh;
}

}  // namespace amhex::server
