// MESH_ENCODING_ARRAYS, as laid out in proto/amhex/v1/geometry.proto.
#include <bit>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "amhex/client.h"

namespace amhex::client {
namespace {

static_assert(std::endian::native == std::endian::little, "the arrays are copied as they are");

constexpr std::string_view kMagic = "AMHEXVOL";
constexpr int32_t kVersion = 1;
constexpr size_t kHeaderBytes = 32;
constexpr int64_t kBytesPerVertex = 24, kBytesPerCell = 37;

template <class T>
T NumberAt(std::string_view bytes, size_t offset) {
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

// Copies `count` elements from `*offset` on and moves it behind them.
template <class T>
std::vector<T> TakeArray(std::string_view bytes, int64_t count, size_t* offset) {
  std::vector<T> array(static_cast<size_t>(count));
  if (count == 0) return array;
  std::memcpy(static_cast<void*>(array.data()), bytes.data() + *offset, array.size() * sizeof(T));
  *offset += array.size() * sizeof(T);
  return array;
}

}  // namespace

absl::StatusOr<AtMostHexaMesh> DecodeMesh(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes || bytes.substr(0, kMagic.size()) != kMagic) {
    return absl::DataLossError("the result does not begin like a mesh");
  }
  const auto version = NumberAt<int32_t>(bytes, 8);
  if (version != kVersion) {
    return absl::DataLossError(
        absl::StrCat("the result has version ", version, ", not ", kVersion));
  }
  const auto vertex_count = NumberAt<int64_t>(bytes, 16);
  const auto cell_count = NumberAt<int64_t>(bytes, 24);
  const auto body = static_cast<int64_t>(bytes.size() - kHeaderBytes);
  if (vertex_count < 0 || cell_count < 0 || vertex_count > body / kBytesPerVertex ||
      cell_count > body / kBytesPerCell ||
      kBytesPerVertex * vertex_count + kBytesPerCell * cell_count != body) {
    return absl::DataLossError(absl::StrCat("the result has ", bytes.size(),
                                            " bytes, which is not ", vertex_count, " vertices and ",
                                            cell_count, " cells"));
  }
  AtMostHexaMesh mesh;
  size_t offset = kHeaderBytes;
  mesh.vertices = TakeArray<Vec3d>(bytes, vertex_count, &offset);
  mesh.corners = TakeArray<CellCorners>(bytes, cell_count, &offset);
  mesh.quality = TakeArray<float>(bytes, cell_count, &offset);
  for (uint8_t type : TakeArray<uint8_t>(bytes, cell_count, &offset)) {
    mesh.types.push_back(static_cast<PrimitiveType>(type));
  }
  return mesh;
}

}  // namespace amhex::client
