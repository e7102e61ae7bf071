// The laws of an at-most-hexa mesh, checked the slow and plain way.
//
// Shares no code with the engine on purpose: a mistake in the engine's validator or cell tables
// cannot hide here. Uses only the mesh type.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "amhex/volume_mesh.h"

namespace amhex::testing_support {

// A triangle or quad of vertex ids, outward for the cell it was taken from.
using Polygon = std::vector<int32_t>;

// The faces of one cell after its collapses: repeated corners removed, vanished faces left out.
std::vector<Polygon> CellPolygons(const CellCorners& corners);

// Faces seen exactly once, outward for the mesh.
std::vector<Polygon> BoundaryPolygons(const AtMostHexaMesh& mesh);

// Exact volume of the cell's trilinear map, as the flux through its bilinear faces.
double PolygonCellVolume(const CellCorners& corners, const std::vector<Vec3d>& vertices);

// Least scaled Jacobian over the vertices where exactly three edges of the collapsed cell meet.
double LeastScaledJacobian(const CellCorners& corners, const std::vector<Vec3d>& vertices);

double TotalVolume(const AtMostHexaMesh& mesh);

struct BoundaryMeasures {
  int64_t face_count = 0;
  int64_t component_count = 0;
  int64_t euler_number = 0;  // V - E + F, summed over the components
  double enclosed_volume = 0;
};
BoundaryMeasures MeasureBoundary(const AtMostHexaMesh& mesh);

// One sentence per broken law, naming the first place; empty for a valid mesh. The laws:
//   1. arrays agree in length, indices are in range, positions are finite;
//   2. every cell is one of Figure 2's, closed in itself, and has the type it claims;
//   3. every face is shared by at most two cells, and then seen from opposite sides;
//   4. no boundary quad lies on a boundary triangle (the two sides of one wall cut differently);
//   5. the boundary is closed: every directed edge once, and once in reverse;
//   6. every volume and every least scaled Jacobian is positive;
//   7. every vertex is used by a cell;
//   8. the cells' volumes add up to what the boundary encloses.
std::vector<std::string> BrokenLaws(const AtMostHexaMesh& mesh);

}  // namespace amhex::testing_support
