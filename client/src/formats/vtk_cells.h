// VTK's cell types and the order in which each lists its vertices.
//
//   VTK_TETRA       base 0 1 2 seen counter-clockwise from 3
//   VTK_HEXAHEDRON  rings 0 1 2 3 and 4 5 6 7, the first counter-clockwise seen from the second
//   VTK_WEDGE       triangles 0 1 2 and 3 4 5, the first counter-clockwise seen from outside:
//                   the other way round than the hexahedron's rings (VTK's vtkWedge manual)
//   VTK_PYRAMID     base 0 1 2 3 seen counter-clockwise from the apex 4
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "amhex/volume_mesh.h"

namespace amhex::client {

inline constexpr uint8_t kVtkTetra = 10;
inline constexpr uint8_t kVtkHexahedron = 12;
inline constexpr uint8_t kVtkWedge = 13;
inline constexpr uint8_t kVtkPyramid = 14;

struct VtkCell {
  uint8_t type = kVtkHexahedron;
  int count = 0;
  std::array<int32_t, 8> vertex{};
};

// The cell in VTK's words, whatever rotation of its pattern the corners are in; hexprisms and
// slices stay hexahedra with repeated ids, and so does anything that is no known cell.
VtkCell ToVtkCell(const CellCorners& corners);

// Eight corners, or nullopt for a VTK type that is none of the four or a wrong count of vertices.
std::optional<CellCorners> FromVtkCell(const VtkCell& cell);

// The same cell in the order of corners that a file with VTK's cells gives back, whatever rotation
// of its pattern the corners are in.
CellCorners OrderedCorners(const CellCorners& corners);

}  // namespace amhex::client
