// VTK's legacy unstructured grids, binary.
#include <bit>
#include <cstring>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "formats/mesh_file.h"
#include "formats/vtk_cells.h"

namespace amhex::client {
namespace {

static_assert(std::endian::native == std::endian::little, "legacy files are big-endian");

template <class T>
void AppendBigEndian(T value, std::string* bytes) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  bytes->append(raw.rbegin(), raw.rend());
}

// Field data; texts as in .vtu.
std::string FieldOf(const std::vector<MeshFact>& facts) {
  std::string field = absl::StrCat("FIELD facts ", facts.size(), "\n");
  for (const MeshFact& fact : facts) {
    if (const auto* text = std::get_if<std::string>(&fact.value)) {
      absl::StrAppend(&field, fact.name, " 1 ", text->size() + 1, " unsigned_char\n", *text);
      field += '\0';
    } else {
      const std::vector<double> numbers = NumbersOf(fact);
      absl::StrAppend(&field, fact.name, " 1 ", numbers.size(), " double\n");
      for (double number : numbers) AppendBigEndian(number, &field);
    }
    field += "\n";
  }
  return field;
}

}  // namespace

std::string FormatVtk(const MeshDocument& document) {
  const AtMostHexaMesh& mesh = document.mesh;
  std::string bytes =
      "# vtk DataFile Version 3.0\nat-most-hexa mesh\nBINARY\nDATASET UNSTRUCTURED_GRID\n";
  if (!document.facts.empty()) bytes += FieldOf(document.facts);
  absl::StrAppend(&bytes, "POINTS ", mesh.vertices.size(), " double\n");
  for (const Vec3d& v : mesh.vertices) {
    for (int axis = 0; axis < 3; ++axis) AppendBigEndian(v[axis], &bytes);
  }
  std::string cells, types;
  size_t number_count = 0;
  for (const CellCorners& corners : mesh.corners) {
    const VtkCell cell = ToVtkCell(corners);
    AppendBigEndian<int32_t>(cell.count, &cells);
    for (int i = 0; i < cell.count; ++i) AppendBigEndian(cell.vertex[i], &cells);
    number_count += 1 + static_cast<size_t>(cell.count);
    AppendBigEndian<int32_t>(cell.type, &types);
  }
  absl::StrAppend(&bytes, "\nCELLS ", mesh.corners.size(), " ", number_count, "\n", cells);
  absl::StrAppend(&bytes, "\nCELL_TYPES ", mesh.corners.size(), "\n", types);
  absl::StrAppend(&bytes, "\nCELL_DATA ", mesh.corners.size(),
                  "\nSCALARS scaled_jacobian float 1\nLOOKUP_TABLE default\n");
  for (float quality : mesh.quality) AppendBigEndian(quality, &bytes);
  if (!document.distances.empty()) {
    bytes += "\nSCALARS distance_to_input float 1\nLOOKUP_TABLE default\n";
    for (float distance : document.distances) AppendBigEndian(distance, &bytes);
  }
  bytes += "\nSCALARS cell_type unsigned_char 1\nLOOKUP_TABLE default\n";
  for (PrimitiveType type : mesh.types) bytes += static_cast<char>(type);
  return bytes + "\n";
}

}  // namespace amhex::client
