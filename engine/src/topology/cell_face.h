// Faces as rings of vertex ids; usable where bodies run.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/vec3.h"
#include "geometry/cubes_view.h"
#include "topology/primitives.h"

namespace amhex {

// The cube's face in that direction without repeated neighbours; its count is 0 if it has collapsed
// or folded.
AMHEX_HD inline CellFace CollapsedFace(const CellCorners& corners, int direction) {
  const int32_t a = corners[CornerOfFace(direction, 0)], b = corners[CornerOfFace(direction, 1)],
                c = corners[CornerOfFace(direction, 2)], d = corners[CornerOfFace(direction, 3)];
  if (a != b && b != c && c != d && d != a && a != c && b != d) return {4, {a, b, c, d}};
  CellFace face;
  for (int q = 0; q < 4; ++q) {
    const int32_t v = corners[CornerOfFace(direction, q)];
    if (face.count > 0 && face.v[face.count - 1] == v) continue;
    face.v[face.count++] = v;
  }
  if (face.count > 1 && face.v[face.count - 1] == face.v[0]) --face.count;
  for (int i = face.count; i < 4; ++i) face.v[i] = -1;
  const bool folded = face.count == 4 && (face.v[0] == face.v[2] || face.v[1] == face.v[3]);
  if (face.count < 3 || folded) face.count = 0;
  return face;
}

AMHEX_HD inline CellFaces CollapsedFaces(const CellCorners& corners) {
  CellFaces faces;
  for (int direction = 0; direction < kDirectionCount; ++direction) {
    const CellFace face = CollapsedFace(corners, direction);
    if (face.count > 0) faces.face[faces.count++] = face;
  }
  return faces;
}

// The same ring from the smallest id on.
AMHEX_HD inline CellFace FromSmallest(const CellFace& face) {
  int smallest = 0;
  for (int i = 1; i < face.count; ++i) {
    if (face.v[i] < face.v[smallest]) smallest = i;
  }
  CellFace turned = face;
  for (int i = 0; i < face.count; ++i) turned.v[i] = face.v[(smallest + i) % face.count];
  return turned;
}

// The ring walked backwards, from the smallest id on.
AMHEX_HD inline CellFace BackwardsFromSmallest(const CellFace& face) {
  CellFace backwards = face;
  for (int i = 0; i < face.count; ++i) backwards.v[i] = face.v[face.count - 1 - i];
  return FromSmallest(backwards);
}

}  // namespace amhex
