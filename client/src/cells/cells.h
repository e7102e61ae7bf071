// What a client knows of the cells of an at-most-hexa mesh: faces, type, volume and quality.
//
// Written independently of the engine, so that a received mesh is checked by other code than made
// it. Corner order is VTK_HEXAHEDRON's (volume_mesh.h); repeated ids are collapsed edges.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "amhex/volume_mesh.h"

namespace amhex::client {

// A face after collapse: three or four distinct vertices, counter-clockwise seen from outside.
struct Face {
  int count = 0;
  std::array<int32_t, 4> vertex{-1, -1, -1, -1};
};

// The faces left of a cell after its collapses.
struct FaceList {
  int count = 0;
  std::array<Face, 6> face;
  std::array<int, 6>
      side{};  // which of the hexahedron's faces it is: 0321 4567 0154 1265 2376 3047
  const Face* begin() const { return face.data(); }
  const Face* end() const { return face.data() + count; }
};

FaceList FacesOfCell(const CellCorners& corners);

// The type that the faces say, or nullopt if they are those of no cell of the paper's Figure 2 or
// do not close: every edge must be passed once in each direction.
std::optional<PrimitiveType> TypeOfCell(const CellCorners& corners);

// Signed volume of the trilinear map of the eight corners (2x2x2 Gauss points, which is exact).
double VolumeOfCell(const CellCorners& corners, const std::vector<Vec3d>& vertices);

// Minimum over the corners where exactly three edges meet of the determinant of the normalised
// edges; 1 is a cube, 0 or less is degenerate or inverted.
double ScaledJacobianOfCell(const CellCorners& corners, const std::vector<Vec3d>& vertices);

// Mean of the cell's distinct vertices.
Vec3d CentreOfCell(const CellCorners& corners, const std::vector<Vec3d>& vertices);

// "hexahedron", "hexprism", "prism", "slice", "pyramid" or "tetrahedron".
const char* PrimitiveName(PrimitiveType type);

}  // namespace amhex::client
