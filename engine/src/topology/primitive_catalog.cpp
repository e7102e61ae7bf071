#include "topology/primitive_catalog.h"

#include <algorithm>

#include "topology/shape_overlay.h"

namespace amhex {

const PrimitiveShape& ShapeOf(PrimitiveType type) {
  return *std::find_if(kPrimitiveCatalog.begin(), kPrimitiveCatalog.end(),
                       [type](const PrimitiveShape& shape) { return shape.type == type; });
}

std::optional<CellCorners> CornersFromFaces(PrimitiveType type, std::span<const CellFace> faces) {
  const PrimitiveShape& shape = ShapeOf(type);
  if (static_cast<int>(faces.size()) != shape.face_count()) return std::nullopt;
  CellFaces rings;
  for (const CellFace& face : faces) rings.face[rings.count++] = face;
  CellCorners corners;
  if (!ShapeOverlay(shape, rings).Find(corners)) return std::nullopt;
  return corners;
}

}  // namespace amhex
