// Point in cell, for cells that are star-shaped enough to be tested by their face planes.
#pragma once

#include <vector>

#include "topology/primitives.h"

namespace amhex {

// True if `p` lies behind all triangles of one diagonal of all faces. Conservative at folds.
inline bool CellContains(const CellCorners& corners, const std::vector<Vec3d>& vertices,
                         const Vec3d& p) {
  for (const CellFace& face : FacesOf(corners)) {
    const Vec3d& a = vertices[face.v[0]];
    for (int s = 0; s + 2 < face.count; ++s) {
      const Vec3d b = vertices[face.v[1 + s]] - a, c = vertices[face.v[2 + s]] - a;
      if (Determinant(b, c, p - a) >= 0) return false;
    }
  }
  return true;
}

}  // namespace amhex
