// Medit .mesh files.
#include <array>
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "formats/mesh_completion.h"
#include "formats/mesh_file.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"
#include "formats/vtk_cells.h"

namespace amhex::client {
namespace {

// The sections that hold cells. Medit orders prisms and pyramids as VTK's hexahedron does: the
// first triangle or the base counter-clockwise seen from inside.
struct CellSection {
  std::string_view keyword;
  uint8_t vtk_type;
  int count;
  std::array<int, 8> order;  // VTK's vertex i is the file's vertex order[i]
};
constexpr std::array<CellSection, 4> kCellSections = {{
    {"Hexahedra", kVtkHexahedron, 8, {0, 1, 2, 3, 4, 5, 6, 7}},
    {"Prisms", kVtkWedge, 6, {0, 2, 1, 3, 5, 4}},
    {"Pyramids", kVtkPyramid, 5, {0, 1, 2, 3, 4}},
    {"Tetrahedra", kVtkTetra, 4, {0, 1, 2, 3}},
}};

// Other sections with lines that may be skipped.
constexpr std::array<std::string_view, 12> kSkippedSections = {"Edges",
                                                               "Triangles",
                                                               "Quadrilaterals",
                                                               "Corners",
                                                               "RequiredVertices",
                                                               "Ridges",
                                                               "RequiredEdges",
                                                               "Normals",
                                                               "Tangents",
                                                               "NormalAtVertices",
                                                               "RequiredTriangles",
                                                               "SubDomainFromMesh"};

absl::StatusOr<int64_t> ReadCount(TextScanner* scanner, std::string_view keyword) {
  const std::string what = absl::StrCat("the number of ", std::string(keyword));
  AMHEX_ASSIGN_OR_RETURN(const int64_t count, scanner->NextInteger(what));
  constexpr int64_t kShortestLine = 2;
  if (count < 0 || count > static_cast<int64_t>(scanner->remaining()) / kShortestLine) {
    return scanner->Error(
        absl::StrCat(what, " is ", count, ", but only ", scanner->remaining(), " bytes follow"));
  }
  return count;
}

absl::Status ReadVertices(TextScanner* scanner, AtMostHexaMesh* mesh) {
  AMHEX_ASSIGN_OR_RETURN(const int64_t count, ReadCount(scanner, "Vertices"));
  mesh->vertices.reserve(static_cast<size_t>(count));
  for (int64_t i = 0; i < count; ++i) {
    Vec3d v;
    for (int axis = 0; axis < 3; ++axis) {
      AMHEX_ASSIGN_OR_RETURN(v[axis], scanner->NextDouble("a vertex coordinate"));
    }
    scanner->SkipLine();
    mesh->vertices.push_back(v);
  }
  return absl::OkStatus();
}

absl::Status ReadCells(TextScanner* scanner, const CellSection& section, AtMostHexaMesh* mesh) {
  AMHEX_ASSIGN_OR_RETURN(const int64_t count, ReadCount(scanner, section.keyword));
  for (int64_t i = 0; i < count; ++i) {
    std::array<int32_t, 8> vertex{};
    for (int k = 0; k < section.count; ++k) {
      AMHEX_ASSIGN_OR_RETURN(const int64_t number, scanner->NextInteger("a cell's vertex"));
      if (number < 1 || number > static_cast<int64_t>(mesh->vertices.size())) {
        return scanner->Error(absl::StrCat("a cell names vertex ", number, "; there are 1 to ",
                                           mesh->vertices.size()));
      }
      vertex[k] = static_cast<int32_t>(number - 1);
    }
    VtkCell cell{section.vtk_type, section.count, {}};
    for (int k = 0; k < section.count; ++k) cell.vertex[k] = vertex[section.order[k]];
    mesh->corners.push_back(*FromVtkCell(cell));
    scanner->SkipLine();
  }
  return absl::OkStatus();
}

absl::Status SkipSection(TextScanner* scanner, std::string_view keyword) {
  AMHEX_ASSIGN_OR_RETURN(const int64_t count, ReadCount(scanner, keyword));
  scanner->SkipLine();
  for (int64_t i = 0; i < count; ++i) scanner->SkipLine();
  return absl::OkStatus();
}

absl::Status ReadSection(TextScanner* scanner, std::string_view keyword, AtMostHexaMesh* mesh) {
  if (keyword == "MeshVersionFormatted") return scanner->NextInteger("the version").status();
  if (keyword == "Dimension") {
    AMHEX_ASSIGN_OR_RETURN(const int64_t dimension, scanner->NextInteger("the dimension"));
    if (dimension != 3) return scanner->Error(absl::StrCat("dimension ", dimension, " is not 3"));
    return absl::OkStatus();
  }
  if (keyword == "Vertices") return ReadVertices(scanner, mesh);
  for (const CellSection& section : kCellSections) {
    if (section.keyword == keyword) return ReadCells(scanner, section, mesh);
  }
  for (std::string_view skipped : kSkippedSections) {
    if (skipped == keyword) return SkipSection(scanner, keyword);
  }
  return scanner->Error("unknown section " + Quoted(keyword));
}

}  // namespace

std::string FormatMedit(const MeshDocument& document) {
  const AtMostHexaMesh& mesh = document.mesh;
  std::string text =
      absl::StrCat("MeshVersionFormatted 2\nDimension 3\nVertices\n", mesh.vertices.size(), "\n");
  for (const Vec3d& v : mesh.vertices) {
    absl::StrAppendFormat(&text, "%.17g %.17g %.17g 0\n", v.x, v.y, v.z);
  }
  absl::StrAppend(&text, "Hexahedra\n", mesh.corners.size(), "\n");
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    for (int32_t vertex : OrderedCorners(mesh.corners[cell]))
      absl::StrAppend(&text, vertex + 1, " ");
    absl::StrAppend(&text, static_cast<int>(mesh.types[cell]), "\n");
  }
  return text + "End\n";
}

absl::StatusOr<MeshDocument> ReadMedit(std::string_view bytes) {
  TextScanner scanner(bytes, '#');
  MeshDocument document;
  bool has_end = false;
  std::string_view keyword = scanner.NextWord();
  if (keyword != "MeshVersionFormatted") {
    return scanner.Error("a Medit file begins with MeshVersionFormatted, not " + Quoted(keyword));
  }
  for (; !keyword.empty() && !has_end; keyword = scanner.NextWord()) {
    if (keyword == "End") {
      has_end = true;
    } else {
      AMHEX_RETURN_IF_ERROR(ReadSection(&scanner, keyword, &document.mesh));
    }
  }
  if (!has_end) return scanner.Error("the file ends without the word End");
  if (document.mesh.corners.empty()) {
    return absl::InvalidArgumentError("the file contains no volume cell");
  }
  AMHEX_RETURN_IF_ERROR(CompleteMesh(&document.mesh));
  return document;
}

}  // namespace amhex::client
