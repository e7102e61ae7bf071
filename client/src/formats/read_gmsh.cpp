// Gmsh's .msh files, versions 2.2 and 4.1 in ascii, as volume meshes.
#include <array>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "formats/mesh_completion.h"
#include "formats/mesh_file.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"
#include "formats/volume_builder.h"
#include "formats/volume_reader.h"
#include "formats/vtk_cells.h"

namespace amhex::client {
namespace {

// Gmsh lists the vertices of prisms with the first triangle counter-clockwise seen from inside, of
// the others as VTK does.
struct ElementType {
  int64_t number;
  int vertex_count;
  int vtk_type;  // 0: of fewer dimensions
  std::array<int, 8> order;
};
constexpr std::array<ElementType, 8> kElementTypes = {{
    {15, 1, 0, {}},
    {1, 2, 0, {}},
    {2, 3, 0, {}},
    {3, 4, 0, {}},
    {4, 4, kVtkTetra, {0, 1, 2, 3}},
    {5, 8, kVtkHexahedron, {0, 1, 2, 3, 4, 5, 6, 7}},
    {6, 6, kVtkWedge, {0, 2, 1, 3, 5, 4}},
    {7, 5, kVtkPyramid, {0, 1, 2, 3, 4}},
}};

class GmshReader {
 public:
  explicit GmshReader(std::string_view bytes) : scanner_(bytes) {}

  absl::StatusOr<VolumeBuilder> Read() {
    for (std::string_view word = scanner_.NextWord(); !word.empty(); word = scanner_.NextWord()) {
      AMHEX_RETURN_IF_ERROR(ReadSection(word));
    }
    if (builder_.mesh.cell_faces.empty()) {
      return absl::InvalidArgumentError("the file contains no volume cell");
    }
    return std::move(builder_);
  }

 private:
  absl::Status ReadSection(std::string_view name) {
    if (version_ == 0 && name != "$MeshFormat") {
      return scanner_.Error("a Gmsh file begins with $MeshFormat, not " + Quoted(name));
    }
    if (name == "$MeshFormat") return ReadFormat();
    if (name == "$Nodes") return version_ < 4 ? ReadNodes2() : ReadNodes4();
    if (name == "$Elements") return version_ < 4 ? ReadElements2() : ReadElements4();
    if (name[0] != '$') return scanner_.Error("no section begins with " + Quoted(name));
    const std::string end = absl::StrCat("$End", std::string(name.substr(1)));
    for (std::string_view word = scanner_.NextWord(); word != end; word = scanner_.NextWord()) {
      if (word.empty()) return scanner_.Error("the file ends without " + end);
    }
    return absl::OkStatus();
  }

  absl::Status ReadFormat() {
    AMHEX_ASSIGN_OR_RETURN(const double version, scanner_.NextDouble("the version"));
    AMHEX_ASSIGN_OR_RETURN(const int64_t file_type, scanner_.NextInteger("the file type"));
    if (file_type != 0 || (version != 2.2 && version != 4.1)) {
      return scanner_.Error("only versions 2.2 and 4.1 in ascii are read");
    }
    version_ = static_cast<int>(version);
    scanner_.SkipLine();
    return Expect("$EndMeshFormat");
  }

  absl::Status ReadNodes2() {
    AMHEX_ASSIGN_OR_RETURN(const int64_t count, Count("nodes"));
    for (int64_t i = 0; i < count; ++i) {
      AMHEX_ASSIGN_OR_RETURN(const int64_t tag, scanner_.NextInteger("a node's number"));
      AMHEX_RETURN_IF_ERROR(ReadNode(tag));
      scanner_.SkipLine();
    }
    return Expect("$EndNodes");
  }

  absl::Status ReadNodes4() {
    AMHEX_ASSIGN_OR_RETURN(const int64_t blocks, Count("node blocks"));
    scanner_.SkipLine();
    for (int64_t b = 0; b < blocks; ++b) {
      AMHEX_RETURN_IF_ERROR(SkipIntegers(3));
      AMHEX_ASSIGN_OR_RETURN(const int64_t count, Count("nodes of a block"));
      std::vector<int64_t> tags;
      for (int64_t i = 0; i < count; ++i) {
        AMHEX_ASSIGN_OR_RETURN(const int64_t tag, scanner_.NextInteger("a node's number"));
        tags.push_back(tag);
      }
      for (const int64_t tag : tags) {
        AMHEX_RETURN_IF_ERROR(ReadNode(tag));
        scanner_.SkipLine();
      }
    }
    return Expect("$EndNodes");
  }

  absl::Status ReadNode(int64_t tag) {
    Vec3d p;
    for (int axis = 0; axis < 3; ++axis) {
      AMHEX_ASSIGN_OR_RETURN(p[axis], scanner_.NextDouble("a node's coordinate"));
    }
    vertex_of_tag_[tag] = static_cast<int64_t>(builder_.mesh.vertices.size());
    builder_.mesh.vertices.push_back(p);
    return absl::OkStatus();
  }

  absl::Status ReadElements2() {
    AMHEX_ASSIGN_OR_RETURN(const int64_t count, Count("elements"));
    for (int64_t i = 0; i < count; ++i) {
      AMHEX_RETURN_IF_ERROR(SkipIntegers(1));
      AMHEX_ASSIGN_OR_RETURN(const int64_t type, scanner_.NextInteger("an element's type"));
      AMHEX_ASSIGN_OR_RETURN(const int64_t tags, Count("an element's tags"));
      AMHEX_RETURN_IF_ERROR(SkipIntegers(tags));
      AMHEX_RETURN_IF_ERROR(ReadElement(type));
    }
    return Expect("$EndElements");
  }

  absl::Status ReadElements4() {
    AMHEX_ASSIGN_OR_RETURN(const int64_t blocks, Count("element blocks"));
    scanner_.SkipLine();
    for (int64_t b = 0; b < blocks; ++b) {
      AMHEX_RETURN_IF_ERROR(SkipIntegers(2));
      AMHEX_ASSIGN_OR_RETURN(const int64_t type, scanner_.NextInteger("a block's element type"));
      AMHEX_ASSIGN_OR_RETURN(const int64_t count, Count("elements of a block"));
      for (int64_t i = 0; i < count; ++i) {
        AMHEX_RETURN_IF_ERROR(SkipIntegers(1));
        AMHEX_RETURN_IF_ERROR(ReadElement(type));
      }
    }
    return Expect("$EndElements");
  }

  absl::Status ReadElement(int64_t number) {
    for (const ElementType& type : kElementTypes) {
      if (type.number != number) continue;
      std::array<int64_t, 8> listed{}, vertices{};
      for (int i = 0; i < type.vertex_count; ++i) {
        AMHEX_ASSIGN_OR_RETURN(const int64_t tag, scanner_.NextInteger("an element's node"));
        const auto vertex = vertex_of_tag_.find(tag);
        if (vertex == vertex_of_tag_.end()) {
          return scanner_.Error(
              absl::StrCat("an element names node ", tag, ", which is not there"));
        }
        listed[i] = vertex->second;
      }
      if (type.vtk_type == 0) return absl::OkStatus();
      for (int i = 0; i < type.vertex_count; ++i) vertices[i] = listed[type.order[i]];
      return builder_.AddCell(type.vtk_type,
                              {vertices.data(), static_cast<size_t>(type.vertex_count)});
    }
    return scanner_.Error(absl::StrCat("elements of type ", number, " are not read"));
  }

  absl::Status SkipIntegers(int64_t count) {
    for (int64_t i = 0; i < count; ++i) {
      AMHEX_RETURN_IF_ERROR(scanner_.NextInteger("a number").status());
    }
    return absl::OkStatus();
  }

  // Of things that take at least two bytes each.
  absl::StatusOr<int64_t> Count(std::string_view what) {
    AMHEX_ASSIGN_OR_RETURN(const int64_t count,
                           scanner_.NextInteger(absl::StrCat("the number of ", std::string(what))));
    if (count >= 0 && count <= static_cast<int64_t>(scanner_.remaining()) / 2) return count;
    return scanner_.Error(absl::StrCat("the number of ", std::string(what), " is ", count,
                                       ", but only ", scanner_.remaining(), " bytes follow"));
  }

  absl::Status Expect(std::string_view word) {
    const std::string_view found = scanner_.NextWord();
    if (found == word) return absl::OkStatus();
    return scanner_.Error(absl::StrCat("expected ", std::string(word), ", found ", Quoted(found)));
  }

  TextScanner scanner_;
  int version_ = 0;
  absl::flat_hash_map<int64_t, int64_t> vertex_of_tag_;  // only looked up
  VolumeBuilder builder_;
};

}  // namespace

absl::StatusOr<VolumeMesh> ReadGmshVolume(std::string_view bytes) {
  AMHEX_ASSIGN_OR_RETURN(VolumeBuilder builder, GmshReader(bytes).Read());
  return std::move(builder.mesh);
}

absl::StatusOr<MeshDocument> ReadGmsh(std::string_view bytes) {
  AMHEX_ASSIGN_OR_RETURN(VolumeBuilder builder, GmshReader(bytes).Read());
  MeshDocument document;
  AMHEX_ASSIGN_OR_RETURN(document.mesh, MeshOf(std::move(builder)));
  return document;
}

}  // namespace amhex::client
