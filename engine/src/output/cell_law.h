// What one cell must be, derived from Figure 2's 8-corner lists and the trilinear map alone.
//
// Written apart from topology/ and optimize/ on purpose: the validator must not inherit a mistake
// of the code that builds cells.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"

namespace amhex {

// The type of a cell whose equal corners are those of a pattern of Figure 2, up to the 48
// symmetries of the cube; nullopt for every other way to repeat corners.
std::optional<PrimitiveType> TypeByPattern(const CellCorners& corners);

// An outward face: the ring of a cube face without repeated corners.
struct OutwardFace {
  int count = 0;  // 3 or 4
  std::array<int32_t, 4> v{-1, -1, -1, -1};
};

struct OutwardFaces {
  int count = 0;
  std::array<OutwardFace, 6> face;
  const OutwardFace* begin() const { return face.data(); }
  const OutwardFace* end() const { return face.data() + count; }
};
OutwardFaces OutwardFacesOf(const CellCorners& corners);

// Measures of the trilinear map of one cell. Units: the vertices' units to the third power, but
// for the scaled Jacobian, which is a pure number.
struct CellMeasures {
  double volume = 0;               // exact: 2x2x2 Gauss points
  double min_scaled_jacobian = 0;  // section 5.2: over vertices where exactly three edges meet
  double min_map_jacobian = 0;     // over Gauss points and corners that are not collapsed
};
CellMeasures MeasureCell(const CellCorners& corners, const std::vector<Vec3d>& vertices);

}  // namespace amhex
