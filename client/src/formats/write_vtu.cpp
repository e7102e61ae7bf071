// VTK XML unstructured grids.
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "formats/mesh_file.h"
#include "formats/vtk_arrays.h"
#include "formats/vtk_cells.h"

namespace amhex::client {
namespace {

std::string DataArray(const std::string& type, const std::string& name, int components,
                      const std::string& content) {
  return absl::StrCat("<DataArray type=\"", type, "\" Name=\"", name, "\" NumberOfComponents=\"",
                      components, "\" format=\"binary\">\n", content, "\n</DataArray>\n");
}

std::string FieldArrayTag(const std::string& type, const std::string& name, size_t length) {
  return absl::StrCat("<DataArray type=\"", type, "\" Name=\"", name, "\" NumberOfTuples=\"",
                      length, "\" format=\"ascii\">\n");
}

// Field data have their length stated. Texts are character codes ended by 0, as 8-bit
// numbers: there are readers (meshio) that give up a file with an array of type String.
std::string FieldArray(const MeshFact& fact) {
  std::string array;
  if (const auto* text = std::get_if<std::string>(&fact.value)) {
    array = FieldArrayTag("UInt8", fact.name, text->size() + 1);
    for (unsigned char c : *text) absl::StrAppend(&array, static_cast<int>(c), " ");
    array += "0";
  } else {
    const std::vector<double> numbers = NumbersOf(fact);
    array = FieldArrayTag("Float64", fact.name, numbers.size());
    for (double number : numbers) absl::StrAppendFormat(&array, "%.17g ", number);
  }
  return array + "\n</DataArray>\n";
}

std::string VtuPoints(const AtMostHexaMesh& mesh) {
  std::vector<double> coordinates;
  coordinates.reserve(3 * mesh.vertices.size());
  for (const Vec3d& v : mesh.vertices) coordinates.insert(coordinates.end(), {v.x, v.y, v.z});
  return absl::StrCat("<Points>\n",
                      DataArray("Float64", "Points", 3, EncodeVtkNumbers(coordinates)),
                      "</Points>\n");
}

std::string Cells(const AtMostHexaMesh& mesh) {
  std::vector<int32_t> connectivity;
  std::vector<int64_t> offsets;
  std::vector<uint8_t> types;
  connectivity.reserve(8 * mesh.corners.size());
  for (const CellCorners& corners : mesh.corners) {
    const VtkCell cell = ToVtkCell(corners);
    connectivity.insert(connectivity.end(), cell.vertex.begin(), cell.vertex.begin() + cell.count);
    offsets.push_back(static_cast<int64_t>(connectivity.size()));
    types.push_back(cell.type);
  }
  return absl::StrCat("<Cells>\n",
                      DataArray("Int32", "connectivity", 1, EncodeVtkNumbers(connectivity)),
                      DataArray("Int64", "offsets", 1, EncodeVtkNumbers(offsets)),
                      DataArray("UInt8", "types", 1, EncodeVtkNumbers(types)), "</Cells>\n");
}

std::string CellData(const MeshDocument& document) {
  const AtMostHexaMesh& mesh = document.mesh;
  std::vector<uint8_t> types;
  for (PrimitiveType type : mesh.types) types.push_back(static_cast<uint8_t>(type));
  std::string distances;
  if (!document.distances.empty()) {
    distances = DataArray("Float32", "distance_to_input", 1, EncodeVtkNumbers(document.distances));
  }
  return absl::StrCat("<CellData Scalars=\"scaled_jacobian\">\n",
                      DataArray("UInt8", "cell_type", 1, EncodeVtkNumbers(types)),
                      DataArray("Float32", "scaled_jacobian", 1, EncodeVtkNumbers(mesh.quality)),
                      distances, "</CellData>\n");
}

}  // namespace

std::string FormatVtu(const MeshDocument& document) {
  const AtMostHexaMesh& mesh = document.mesh;
  std::string text =
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n";
  if (!document.facts.empty()) {
    text += "<FieldData>\n";
    for (const MeshFact& fact : document.facts) text += FieldArray(fact);
    text += "</FieldData>\n";
  }
  absl::StrAppend(&text, "<Piece NumberOfPoints=\"", mesh.vertices.size(), "\" NumberOfCells=\"",
                  mesh.corners.size(), "\">\n");
  absl::StrAppend(&text, VtuPoints(mesh), Cells(mesh), CellData(document));
  return text + "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
}

}  // namespace amhex::client
