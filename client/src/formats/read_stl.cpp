// Stereolithography, ascii and binary. STL repeats every corner; equal corners become one vertex.
#include <array>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "formats/byte_reader.h"
#include "formats/hull_builder.h"
#include "formats/hull_reader.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"

namespace amhex::client {
namespace {

constexpr size_t kBinaryHeaderBytes = 80;
constexpr size_t kBinaryTriangleBytes = 50;

// Gives equal positions one index, in order of first appearance.
class Welder {
 public:
  int32_t IndexOf(const Vec3d& p) {
    // Adding zero turns -0 into +0, so that both weld.
    const std::array<double, 3> key = {p.x + 0.0, p.y + 0.0, p.z + 0.0};
    const auto [place, is_new] = index_.try_emplace(key, static_cast<int32_t>(vertices.size()));
    if (is_new) vertices.push_back({key[0], key[1], key[2]});
    return place->second;
  }
  std::vector<Vec3d> vertices;

 private:
  absl::flat_hash_map<std::array<double, 3>, int32_t> index_;
};

absl::StatusOr<InputHull> Weld(const std::vector<Vec3d>& corners) {
  if (corners.empty()) return absl::InvalidArgumentError("the file contains no triangle");
  AMHEX_RETURN_IF_ERROR(CheckFinite(corners, "triangle corner"));
  Welder welder;
  TriangleMesh mesh;
  for (size_t i = 0; i + 2 < corners.size(); i += 3) {
    const int32_t a = welder.IndexOf(corners[i]);
    const int32_t b = welder.IndexOf(corners[i + 1]);
    const int32_t c = welder.IndexOf(corners[i + 2]);
    if (a != b && b != c && c != a) mesh.triangles.push_back({a, b, c});
  }
  if (mesh.triangles.empty()) {
    return absl::InvalidArgumentError("every triangle of the file is degenerate");
  }
  mesh.vertices = std::move(welder.vertices);
  return InputHull(std::move(mesh));
}

absl::StatusOr<InputHull> ReadBinaryStl(std::string_view bytes) {
  ByteReader reader(bytes, std::endian::little);
  uint32_t triangle_count = 0;
  if (!reader.Skip(kBinaryHeaderBytes) || !reader.Read(&triangle_count)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "byte ", bytes.size(), ": the file ends inside the header of a binary STL file"));
  }
  if (triangle_count > reader.remaining() / kBinaryTriangleBytes) {
    return absl::InvalidArgumentError(absl::StrCat(
        "byte ", bytes.size(), ": the header promises ", triangle_count, " triangles, but only ",
        reader.remaining() / kBinaryTriangleBytes, " follow"));
  }
  std::vector<Vec3d> corners;
  corners.reserve(size_t{3} * triangle_count);
  for (uint32_t i = 0; i < triangle_count; ++i) {
    reader.Skip(3 * sizeof(float));  // the normal follows from the corners
    for (int corner = 0; corner < 3; ++corner) {
      float x = 0, y = 0, z = 0;
      reader.Read(&x);
      reader.Read(&y);
      reader.Read(&z);
      corners.push_back({x, y, z});
    }
    reader.Skip(sizeof(uint16_t));
  }
  return Weld(corners);
}

absl::StatusOr<InputHull> ReadAsciiStl(std::string_view bytes) {
  TextScanner scanner(bytes);
  scanner.SkipLine();  // "solid <name>"
  std::vector<Vec3d> corners;
  for (std::string_view word = scanner.NextWord(); !word.empty(); word = scanner.NextWord()) {
    if (word == "vertex") {
      Vec3d v;
      for (int axis = 0; axis < 3; ++axis) {
        AMHEX_ASSIGN_OR_RETURN(v[axis], scanner.NextDouble("a vertex coordinate"));
      }
      corners.push_back(v);
    } else if (word == "endloop") {
      if (corners.size() % 3 != 0) return scanner.Error("a facet does not have three vertices");
    } else if (word == "facet" || word == "solid" || word == "endsolid") {
      scanner.SkipLine();  // the normal, or a name
    } else if (word != "outer" && word != "loop" && word != "endfacet") {
      return scanner.Error("unknown word in an STL file: " + Quoted(word));
    }
  }
  if (corners.size() % 3 != 0) return scanner.Error("the file ends inside a facet");
  return Weld(corners);
}

// Binary files may begin with "solid" too, so the size decides first.
bool LooksBinary(std::string_view bytes) {
  if (bytes.substr(0, 5) != "solid") return true;
  ByteReader reader(bytes, std::endian::little);
  uint32_t triangle_count = 0;
  if (!reader.Skip(kBinaryHeaderBytes) || !reader.Read(&triangle_count)) return false;
  if (reader.remaining() == kBinaryTriangleBytes * size_t{triangle_count}) return true;
  return bytes.substr(0, kBinaryHeaderBytes).find('\0') != std::string_view::npos;
}

}  // namespace

absl::StatusOr<InputHull> ReadStl(std::string_view bytes) {
  return LooksBinary(bytes) ? ReadBinaryStl(bytes) : ReadAsciiStl(bytes);
}

}  // namespace amhex::client
