// One cell of a volume mesh, whatever its shape.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "amhex/vec3.h"
#include "topology/primitives.h"

namespace amhex {

using Polygon = std::vector<int32_t>;  // vertices in ring order

// Turns the faces so that every edge runs once in each direction, all outward; the volume tells
// which way that is. False if the faces do not close to one surface. O(n log n).
bool OrientOutward(const std::vector<Vec3d>& vertices, std::vector<Polygon>* faces);

// The cell of Figure 2 that has these outward faces.
std::optional<CellCorners> CellOfFaces(const std::vector<Polygon>& faces);

// Triangles and quads as they are; larger polygons as triangles around their smallest vertex.
void CutPolygon(const Polygon& polygon, std::vector<CellFace>* pieces);

}  // namespace amhex
