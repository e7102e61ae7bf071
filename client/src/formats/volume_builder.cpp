#include "formats/volume_builder.h"

#include <array>
#include <vector>

#include "absl/strings/str_cat.h"
#include "cells/cells.h"
#include "formats/status_macros.h"
#include "formats/vtk_cells.h"

namespace amhex::client {
namespace {

// VTK numbers the types of cells with fewer than three dimensions below the tetrahedron's.
constexpr int kVtkLastFlat = 9;

// Corners per base of a prism with vertices 0 .. n-1 below and n .. 2n-1 above; 0 for no prism.
int CornersOfBase(int64_t vtk_type) {
  if (vtk_type == kVtkPentagonalPrism) return 5;
  return vtk_type == kVtkHexagonalPrism ? 6 : 0;
}

}  // namespace

absl::Status VolumeBuilder::CheckVertices(std::span<const int64_t> vertices) const {
  for (const int64_t v : vertices) {
    if (v >= 0 && v < static_cast<int64_t>(mesh.vertices.size())) continue;
    return absl::InvalidArgumentError(absl::StrCat("a cell names vertex ", v,
                                                   ", but there are only ", mesh.vertices.size(),
                                                   " vertices (counted from 0)"));
  }
  return absl::OkStatus();
}

void VolumeBuilder::AddCorners(const CellCorners& corners) {
  if (hexahedra.size() == mesh.cell_faces.size()) hexahedra.push_back(corners);
  const FaceList faces = FacesOfCell(corners);
  mesh.cell_faces.push_back(faces.count);
  for (const Face& face : faces) {
    mesh.face_corners.push_back(face.count);
    mesh.corners.insert(mesh.corners.end(), face.vertex.begin(), face.vertex.begin() + face.count);
  }
}

absl::Status VolumeBuilder::AddCell(int64_t vtk_type, std::span<const int64_t> vertices) {
  if (vtk_type >= 0 && vtk_type <= kVtkLastFlat) return absl::OkStatus();
  AMHEX_RETURN_IF_ERROR(CheckVertices(vertices));
  const auto count = static_cast<int>(vertices.size());
  if (const int n = CornersOfBase(vtk_type); n > 0 && count == 2 * n) {
    std::vector<int64_t> stream = {n + 2, n};
    for (int i = 0; i < n; ++i) stream.push_back(vertices[i]);
    stream.push_back(n);
    for (int i = 0; i < n; ++i) stream.push_back(vertices[n + i]);
    for (int i = 0; i < n; ++i) {
      const int next = (i + 1) % n;
      stream.insert(stream.end(),
                    {4, vertices[i], vertices[next], vertices[n + next], vertices[n + i]});
    }
    return AddPolyhedron(stream);
  }
  VtkCell cell{static_cast<uint8_t>(vtk_type == kVtkVoxel ? kVtkHexahedron : vtk_type), count, {}};
  constexpr std::array<int, 8> kVoxelOrder = {0, 1, 3, 2, 4, 5, 7, 6};
  for (int i = 0; i < count && i < 8; ++i) {
    const int from = vtk_type == kVtkVoxel ? kVoxelOrder[i] : i;
    if (from < count) cell.vertex[i] = static_cast<int32_t>(vertices[from]);
  }
  const std::optional<CellCorners> corners =
      vtk_type < 0 || vtk_type > kVtkPyramid ? std::nullopt : FromVtkCell(cell);
  if (!corners) {
    return absl::InvalidArgumentError(absl::StrCat("cell ", mesh.cell_faces.size(),
                                                   " has VTK type ", vtk_type, " with ", count,
                                                   " vertices, which is not read"));
  }
  AddCorners(*corners);
  return absl::OkStatus();
}

absl::Status VolumeBuilder::AddPolyhedron(std::span<const int64_t> stream) {
  const auto malformed = [this] {
    return absl::InvalidArgumentError(absl::StrCat("the face list of cell ", mesh.cell_faces.size(),
                                                   " is cut short or too long"));
  };
  if (stream.empty() || stream[0] < 0 || stream[0] > static_cast<int64_t>(stream.size())) {
    return malformed();
  }
  const int64_t face_count = stream[0];
  size_t at = 1;
  std::vector<int32_t> face_corners, corners;
  for (int64_t f = 0; f < face_count; ++f) {
    if (at >= stream.size() || stream[at] < 0 ||
        stream[at] > static_cast<int64_t>(stream.size() - at - 1)) {
      return malformed();
    }
    const auto ring = stream.subspan(at + 1, static_cast<size_t>(stream[at]));
    AMHEX_RETURN_IF_ERROR(CheckVertices(ring));
    face_corners.push_back(static_cast<int32_t>(ring.size()));
    for (const int64_t v : ring) corners.push_back(static_cast<int32_t>(v));
    at += 1 + ring.size();
  }
  if (at != stream.size()) return malformed();
  mesh.cell_faces.push_back(static_cast<int32_t>(face_count));
  mesh.face_corners.insert(mesh.face_corners.end(), face_corners.begin(), face_corners.end());
  mesh.corners.insert(mesh.corners.end(), corners.begin(), corners.end());
  return absl::OkStatus();
}

}  // namespace amhex::client
