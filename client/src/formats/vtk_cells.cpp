#include "formats/vtk_cells.h"

#include <algorithm>

#include "cells/cells.h"

namespace amhex::client {
namespace {

bool Contains(const Face& face, int32_t vertex) {
  const auto end = face.vertex.begin() + face.count;
  return std::find(face.vertex.begin(), end, vertex) != end;
}

// The only vertex of a pyramid that is not on its base.
int32_t ApexOver(const Face& face, const CellCorners& corners) {
  return *std::find_if(corners.begin(), corners.end(),
                       [&](int32_t vertex) { return !Contains(face, vertex); });
}

// A face is outward; VTK wants the bases of pyramids and tetrahedra as seen from the apex. Begun at
// its least vertex, so that a cell is written alike whether the engine gave it or a file.
VtkCell OverBase(uint8_t type, const Face& base, int32_t apex) {
  VtkCell cell;
  cell.type = type;
  for (int i = base.count - 1; i >= 0; --i) cell.vertex[cell.count++] = base.vertex[i];
  std::rotate(cell.vertex.begin(),
              std::min_element(cell.vertex.begin(), cell.vertex.begin() + base.count),
              cell.vertex.begin() + base.count);
  cell.vertex[cell.count++] = apex;
  return cell;
}

// In a prism, the vertex of the other triangle that shares an edge with `vertex`.
int32_t Across(const FaceList& faces, const Face& triangle, int32_t vertex) {
  for (const Face& face : faces) {
    if (face.count != 4) continue;
    for (int i = 0; i < 4; ++i) {
      const int32_t next = face.vertex[(i + 1) % 4];
      if (face.vertex[i] == vertex && !Contains(triangle, next)) return next;
    }
  }
  return vertex;
}

VtkCell ToWedge(const FaceList& faces) {
  const Face base =
      *std::find_if(faces.begin(), faces.end(), [](const Face& f) { return f.count == 3; });
  VtkCell cell;
  cell.type = kVtkWedge;
  cell.count = 6;
  for (int i = 0; i < 3; ++i) {
    cell.vertex[i] = base.vertex[i];
    cell.vertex[i + 3] = Across(faces, base, base.vertex[i]);
  }
  return cell;
}

}  // namespace

VtkCell ToVtkCell(const CellCorners& corners) {
  const std::optional<PrimitiveType> type = TypeOfCell(corners);
  const FaceList faces = FacesOfCell(corners);
  if (type == PrimitiveType::kTetrahedron) {
    // Any face may be the base; the one without the last vertex is the same in every rotation.
    const int32_t apex = *std::max_element(corners.begin(), corners.end());
    const Face base = *std::find_if(faces.begin(), faces.end(),
                                    [&](const Face& f) { return !Contains(f, apex); });
    return OverBase(kVtkTetra, base, apex);
  }
  if (type == PrimitiveType::kPyramid) {
    const Face base =
        *std::find_if(faces.begin(), faces.end(), [](const Face& f) { return f.count == 4; });
    return OverBase(kVtkPyramid, base, ApexOver(base, corners));
  }
  if (type == PrimitiveType::kPrism) return ToWedge(faces);
  return {kVtkHexahedron, 8, corners};
}

std::optional<CellCorners> FromVtkCell(const VtkCell& cell) {
  const auto& v = cell.vertex;
  if (cell.type == kVtkHexahedron && cell.count == 8) return v;
  if (cell.type == kVtkTetra && cell.count == 4) {
    return CellCorners{v[0], v[1], v[1], v[2], v[0], v[3], v[3], v[2]};
  }
  if (cell.type == kVtkPyramid && cell.count == 5) {
    return CellCorners{v[4], v[0], v[0], v[3], v[4], v[1], v[1], v[2]};
  }
  if (cell.type == kVtkWedge && cell.count == 6) {
    return CellCorners{v[0], v[2], v[2], v[1], v[3], v[5], v[5], v[4]};
  }
  return std::nullopt;
}

CellCorners OrderedCorners(const CellCorners& corners) {
  return FromVtkCell(ToVtkCell(corners)).value_or(corners);
}

}  // namespace amhex::client
