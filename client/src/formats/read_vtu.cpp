// VTK XML unstructured grids: one piece, arrays in ascii or inline zlib-compressed binary.
#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"
#include "formats/mesh_completion.h"
#include "formats/mesh_file.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"
#include "formats/volume_builder.h"
#include "formats/volume_reader.h"
#include "formats/vtk_arrays.h"
#include "formats/vtk_cells.h"

namespace amhex::client {
namespace {

// A start tag, its attributes and the text up to the next tag.
struct Element {
  std::string name;
  std::map<std::string, std::string, std::less<>> attributes;
  std::string_view text;

  std::string Get(std::string_view key) const {
    const auto place = attributes.find(key);
    return place == attributes.end() ? std::string() : place->second;
  }
};

std::string_view Trim(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

void ReadAttributes(std::string_view tag, Element* element) {
  size_t at = tag.find_first_of(" \t\r\n");
  element->name = std::string(tag.substr(0, at));
  while (at != std::string_view::npos) {
    const size_t equals = tag.find('=', at);
    if (equals == std::string_view::npos || equals + 1 >= tag.size()) return;
    const char quote = tag[equals + 1];
    const size_t end = tag.find(quote, equals + 2);
    if (end == std::string_view::npos) return;
    element->attributes[std::string(Trim(tag.substr(at, equals - at)))] =
        std::string(tag.substr(equals + 2, end - equals - 2));
    at = end + 1;
  }
}

// Start tags in document order. Nesting does not matter: names tell our few arrays apart.
absl::StatusOr<std::vector<Element>> StartTags(std::string_view bytes) {
  constexpr size_t kMostTags = 10'000;
  std::vector<Element> elements;
  size_t at = bytes.find('<');
  bool is_whole = false;
  while (at != std::string_view::npos) {
    const size_t end = bytes.find('>', at);
    if (end == std::string_view::npos) break;
    const std::string_view tag = bytes.substr(at + 1, end - at - 1);
    const size_t next = bytes.find('<', end);
    is_whole = tag == "/VTKFile";
    if (!tag.empty() && tag[0] != '/' && tag[0] != '?' && tag[0] != '!') {
      if (elements.size() >= kMostTags) return absl::InvalidArgumentError("too many XML tags");
      Element element;
      ReadAttributes(tag, &element);
      if (next != std::string_view::npos) element.text = bytes.substr(end + 1, next - end - 1);
      elements.push_back(std::move(element));
    }
    at = next;
  }
  if (!is_whole) return absl::InvalidArgumentError("the file ends without </VTKFile>");
  return elements;
}

template <class T>
std::vector<double> NumbersFrom(const std::string& raw) {
  std::vector<double> numbers(raw.size() / sizeof(T));
  for (size_t i = 0; i < numbers.size(); ++i) {
    T value{};
    std::memcpy(&value, raw.data() + i * sizeof(T), sizeof(T));
    numbers[i] = static_cast<double>(value);
  }
  return numbers;
}

absl::StatusOr<std::vector<double>> AsciiVtuNumbers(const Element& array) {
  TextScanner scanner(array.text);
  std::vector<double> numbers;
  for (std::string_view word = scanner.NextWord(); !word.empty(); word = scanner.NextWord()) {
    double value = 0;
    if (!ParseDouble(word, &value)) {
      return absl::InvalidArgumentError(
          absl::StrCat("array ", Quoted(array.Get("Name")), " has no number at ", Quoted(word)));
    }
    numbers.push_back(value);
  }
  return numbers;
}

absl::StatusOr<std::vector<double>> Numbers(const Element& array, size_t most_numbers) {
  const std::string type = array.Get("type"), format = array.Get("format");
  if (format == "ascii") return AsciiVtuNumbers(array);
  if (format != "binary") {
    return absl::InvalidArgumentError("arrays in format " + Quoted(format) + " are not read");
  }
  AMHEX_ASSIGN_OR_RETURN(const std::string raw,
                         DecodeVtkArray(Trim(array.text), most_numbers * sizeof(double)));
  if (type == "Float64") return NumbersFrom<double>(raw);
  if (type == "Float32") return NumbersFrom<float>(raw);
  if (type == "Int64") return NumbersFrom<int64_t>(raw);
  if (type == "Int32") return NumbersFrom<int32_t>(raw);
  if (type == "UInt8") return NumbersFrom<uint8_t>(raw);
  return absl::InvalidArgumentError("arrays of type " + Quoted(type) + " are not read");
}

struct Grid {
  int64_t point_count = -1, cell_count = -1;
  std::vector<double> points, connectivity, offsets, types, quality, distances;
  std::vector<double> faces, face_offsets;  // of polyhedra: VTK's face streams and their ends
};

// Numbers in an array per byte of the file: zlib shrinks by a factor of about a thousand at most.
constexpr size_t kMostNumbersPerByte = 128;

absl::Status ReadFact(const Element& array, std::vector<MeshFact>* facts) {
  AMHEX_ASSIGN_OR_RETURN(const std::vector<double> numbers, AsciiVtuNumbers(array));
  if (array.Get("type") != "String" && array.Get("type") != "UInt8") {
    if (numbers.size() == 1) {
      facts->push_back({array.Get("Name"), numbers.front()});
    } else {
      facts->push_back({array.Get("Name"), numbers});
    }
    return absl::OkStatus();
  }
  facts->push_back({array.Get("Name"), TextOfCodes(numbers)});
  return absl::OkStatus();
}

absl::Status ReadPiece(const Element& piece, size_t file_bytes, Grid* grid) {
  if (grid->point_count >= 0) return absl::InvalidArgumentError("the file has several pieces");
  // zlib shrinks by a factor of about a thousand at most, and a point has three numbers.
  const int64_t most = static_cast<int64_t>(file_bytes * kMostNumbersPerByte);
  if (!ParseInteger(piece.Get("NumberOfPoints"), &grid->point_count) ||
      !ParseInteger(piece.Get("NumberOfCells"), &grid->cell_count) || grid->point_count < 0 ||
      grid->cell_count < 0 || grid->point_count > most || grid->cell_count > most) {
    return absl::InvalidArgumentError("the piece does not say how many points and cells it has");
  }
  return absl::OkStatus();
}

absl::Status ReadArray(const Element& array, size_t file_bytes, Grid* grid) {
  const size_t points = static_cast<size_t>(grid->point_count);
  const size_t cells = static_cast<size_t>(grid->cell_count);
  const std::string name = array.Get("Name");
  std::vector<double>* target = nullptr;
  size_t most = cells;
  if (name == "connectivity") {
    target = &grid->connectivity;
    most = kMostNumbersPerByte * file_bytes;
  } else if (name == "faces") {
    target = &grid->faces;
    most = kMostNumbersPerByte * file_bytes;
  } else if (name == "faceoffsets") {
    target = &grid->face_offsets;
  } else if (name == "offsets") {
    target = &grid->offsets;
  } else if (name == "types") {
    target = &grid->types;
  } else if (name == "scaled_jacobian") {
    target = &grid->quality;
  } else if (name == "distance_to_input") {
    target = &grid->distances;
  } else if (grid->points.empty() && array.Get("NumberOfComponents") == "3") {
    target = &grid->points;
    most = 3 * points;
  }
  if (target == nullptr) return absl::OkStatus();
  AMHEX_ASSIGN_OR_RETURN(*target, Numbers(array, most));
  return absl::OkStatus();
}

absl::Status CheckSizes(const Grid& grid) {
  const size_t points = static_cast<size_t>(grid.point_count);
  const size_t cells = static_cast<size_t>(grid.cell_count);
  if (grid.points.size() == 3 * points && grid.offsets.size() == cells &&
      grid.types.size() == cells && cells > 0) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat("the arrays do not hold ", points, " points and ", cells, " cells"));
}

std::vector<Vec3d> PointsOf(const Grid& grid) {
  std::vector<Vec3d> points;
  for (size_t i = 0; i + 2 < grid.points.size(); i += 3) {
    points.push_back({grid.points[i], grid.points[i + 1], grid.points[i + 2]});
  }
  return points;
}

absl::StatusOr<AtMostHexaMesh> MeshFrom(const Grid& grid) {
  AMHEX_RETURN_IF_ERROR(CheckSizes(grid));
  const size_t points = static_cast<size_t>(grid.point_count);
  const size_t cells = static_cast<size_t>(grid.cell_count);
  AtMostHexaMesh mesh;
  mesh.vertices = PointsOf(grid);
  double begin = 0;
  for (size_t cell = 0; cell < cells; ++cell) {
    const double end = grid.offsets[cell];
    if (!(end > begin) || end - begin > 8 || end > static_cast<double>(grid.connectivity.size())) {
      return absl::InvalidArgumentError(absl::StrCat("the offset of cell ", cell, " is wrong"));
    }
    VtkCell vtk_cell{static_cast<uint8_t>(grid.types[cell]), static_cast<int>(end - begin), {}};
    for (int k = 0; k < vtk_cell.count; ++k) {
      const double vertex = grid.connectivity[static_cast<size_t>(begin) + k];
      if (!(vertex >= 0) || vertex >= static_cast<double>(points)) {
        return absl::InvalidArgumentError(
            absl::StrCat("cell ", cell, " names vertex ", vertex, " of ", points));
      }
      vtk_cell.vertex[k] = static_cast<int32_t>(vertex);
    }
    const std::optional<CellCorners> corners = FromVtkCell(vtk_cell);
    if (!corners) {
      return absl::InvalidArgumentError(
          absl::StrCat("cell ", cell, " has VTK type ", vtk_cell.type, " with ", vtk_cell.count,
                       " vertices; tetrahedra, hexahedra, wedges and pyramids are read"));
    }
    mesh.corners.push_back(*corners);
    begin = end;
  }
  for (double quality : grid.quality) mesh.quality.push_back(static_cast<float>(quality));
  if (mesh.quality.size() != cells) mesh.quality.clear();
  AMHEX_RETURN_IF_ERROR(CompleteMesh(&mesh));
  return mesh;
}

// The whole numbers in [begin, end) of an array; INVALID_ARGUMENT if it has no such range.
absl::StatusOr<std::vector<int64_t>> WholeNumbers(const std::vector<double>& numbers, double begin,
                                                  double end, size_t cell) {
  std::vector<int64_t> whole;
  if (!(begin >= 0) || !(end > begin) || end > static_cast<double>(numbers.size())) {
    return absl::InvalidArgumentError(absl::StrCat("the offset of cell ", cell, " is wrong"));
  }
  for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
    // Beyond 2^53 a double is no index of anything.
    const bool is_whole = std::abs(numbers[i]) < 9e15 && numbers[i] == std::floor(numbers[i]);
    if (!is_whole) {
      return absl::InvalidArgumentError(
          absl::StrCat("cell ", cell, " names ", numbers[i], ", which is no index"));
    }
    whole.push_back(static_cast<int64_t>(numbers[i]));
  }
  return whole;
}

absl::StatusOr<VolumeMesh> VolumeFrom(const Grid& grid) {
  AMHEX_RETURN_IF_ERROR(CheckSizes(grid));
  VolumeBuilder builder;
  builder.mesh.vertices = PointsOf(grid);
  double begin = 0, begin_of_faces = 0;
  for (size_t cell = 0; cell < grid.offsets.size(); ++cell) {
    const double type = grid.types[cell];
    const bool is_known = type >= 0 && type <= kVtkPolyhedron && type == std::floor(type);
    if (type == kVtkPolyhedron) {
      if (grid.face_offsets.size() != grid.offsets.size()) {
        return absl::InvalidArgumentError(
            absl::StrCat("cell ", cell, " is a polyhedron, but the file lists no faces for it"));
      }
      AMHEX_ASSIGN_OR_RETURN(
          const std::vector<int64_t> stream,
          WholeNumbers(grid.faces, begin_of_faces, grid.face_offsets[cell], cell));
      AMHEX_RETURN_IF_ERROR(builder.AddPolyhedron(stream));
      begin_of_faces = grid.face_offsets[cell];
    } else {
      AMHEX_ASSIGN_OR_RETURN(const std::vector<int64_t> vertices,
                             WholeNumbers(grid.connectivity, begin, grid.offsets[cell], cell));
      AMHEX_RETURN_IF_ERROR(builder.AddCell(is_known ? static_cast<int64_t>(type) : -1, vertices));
    }
    begin = grid.offsets[cell];
  }
  return std::move(builder.mesh);
}

struct GridAndFacts {
  Grid grid;
  std::vector<MeshFact> facts;
};

absl::StatusOr<GridAndFacts> ReadGrid(std::string_view bytes) {
  AMHEX_ASSIGN_OR_RETURN(const std::vector<Element> elements, StartTags(bytes));
  GridAndFacts read;
  Grid& grid = read.grid;
  for (const Element& element : elements) {
    if (element.name == "VTKFile" && element.Get("type") != "UnstructuredGrid") {
      return absl::InvalidArgumentError("the VTK file holds no unstructured grid");
    }
    if (element.name == "VTKFile" && !element.Get("header_type").empty() &&
        element.Get("header_type") != "UInt64") {
      return absl::InvalidArgumentError("only header_type UInt64 is read");
    }
    if (element.name == "Piece") {
      AMHEX_RETURN_IF_ERROR(ReadPiece(element, bytes.size(), &grid));
    } else if (element.name == "DataArray" && grid.point_count < 0) {
      AMHEX_RETURN_IF_ERROR(ReadFact(element, &read.facts));
    } else if (element.name == "DataArray") {
      AMHEX_RETURN_IF_ERROR(ReadArray(element, bytes.size(), &grid));
    }
  }
  if (grid.point_count < 0) return absl::InvalidArgumentError("the file has no piece");
  return read;
}

}  // namespace

absl::StatusOr<MeshDocument> ReadVtu(std::string_view bytes) {
  AMHEX_ASSIGN_OR_RETURN(GridAndFacts read, ReadGrid(bytes));
  MeshDocument document;
  document.facts = std::move(read.facts);
  AMHEX_ASSIGN_OR_RETURN(document.mesh, MeshFrom(read.grid));
  if (read.grid.distances.size() == document.mesh.corners.size()) {
    for (double distance : read.grid.distances)
      document.distances.push_back(static_cast<float>(distance));
  }
  return document;
}

absl::StatusOr<VolumeMesh> ReadVtuVolume(std::string_view bytes) {
  AMHEX_ASSIGN_OR_RETURN(const GridAndFacts read, ReadGrid(bytes));
  return VolumeFrom(read.grid);
}

}  // namespace amhex::client
