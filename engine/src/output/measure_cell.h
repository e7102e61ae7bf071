// Faces and measures of one cell by its 8 corners alone, usable where bodies run. Written apart
// from topology/ and optimize/ on purpose, as all of the law (cell_law.h).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "base/array_view.h"

namespace amhex {

// An outward face: the ring of a cube face without repeated corners.
struct OutwardFace {
  int count = 0;  // 3 or 4
  std::array<int32_t, 4> v{-1, -1, -1, -1};
};

struct OutwardFaces {
  int count = 0;
  std::array<OutwardFace, 6> face;
  AMHEX_HD const OutwardFace* begin() const { return face.data(); }
  AMHEX_HD const OutwardFace* end() const { return face.data() + count; }
};

// Measures of the trilinear map of one cell. Units: the vertices' units to the third power, but
// for the scaled Jacobian, which is a pure number.
struct CellMeasures {
  double volume = 0;               // exact: 2x2x2 Gauss points
  double min_scaled_jacobian = 0;  // section 5.2: over vertices where exactly three edges meet
  double min_map_jacobian = 0;     // over Gauss points and corners that are not collapsed
};

namespace cell_law {

// Parameter coordinate of a corner slot in VTK_HEXAHEDRON order: bit `slot` of the axis's byte.
AMHEX_HD inline int PlaceOfSlot(int slot, int axis) {
  constexpr uint32_t kPlaces = 0xF0CC66;
  return static_cast<int>(kPlaces >> (8 * axis + slot) & 1);
}

AMHEX_HD inline int SlotAt(int x, int y, int z) {
  constexpr int kSlots[2][2][2] = {{{0, 4}, {3, 7}}, {{1, 5}, {2, 6}}};
  return kSlots[x][y][z];
}

// The trilinear map's Jacobian determinant at parameter point (u, v, w) of the unit cube.
AMHEX_HD inline double MapJacobian(const std::array<Vec3d, 8>& x, double u, double v, double w) {
  Vec3d du, dv, dw;
  for (int i = 0; i < 8; ++i) {
    const double a = PlaceOfSlot(i, 0) != 0 ? u : 1 - u, da = PlaceOfSlot(i, 0) != 0 ? 1 : -1;
    const double b = PlaceOfSlot(i, 1) != 0 ? v : 1 - v, db = PlaceOfSlot(i, 1) != 0 ? 1 : -1;
    const double c = PlaceOfSlot(i, 2) != 0 ? w : 1 - w, dc = PlaceOfSlot(i, 2) != 0 ? 1 : -1;
    du += x[i] * (da * b * c);
    dv += x[i] * (a * db * c);
    dw += x[i] * (a * b * dc);
  }
  return Determinant(du, dv, dw);
}

// True if the three parameter edges at `slot` lead to three vertices other than its own.
AMHEX_HD inline bool IsUncollapsed(const CellCorners& corners, int slot) {
  const int p[3] = {PlaceOfSlot(slot, 0), PlaceOfSlot(slot, 1), PlaceOfSlot(slot, 2)};
  const int32_t a = corners[SlotAt(1 - p[0], p[1], p[2])];
  const int32_t b = corners[SlotAt(p[0], 1 - p[1], p[2])];
  const int32_t c = corners[SlotAt(p[0], p[1], 1 - p[2])];
  const int32_t v = corners[slot];
  return v != a && v != b && v != c && a != b && b != c && c != a;
}

// The scaled Jacobian at the j-th vertex of `face`, or 1 where not exactly three edges meet.
AMHEX_HD inline double ScaledJacobianAt(const OutwardFaces& faces, const OutwardFace& face, int j,
                                        ArrayView<const Vec3d> vertices) {
  const int32_t at = face.v[j];
  const int32_t next = face.v[(j + 1) % face.count];
  const int32_t previous = face.v[(j + face.count - 1) % face.count];
  int incident_faces = 0;
  int32_t third = -1;
  for (const OutwardFace& other : faces) {
    for (int k = 0; k < other.count; ++k) {
      if (other.v[k] != at) continue;
      ++incident_faces;
      if (other.v[(k + 1) % other.count] == previous) {
        third = other.v[(k + other.count - 1) % other.count];
      }
    }
  }
  if (incident_faces != 3) return 1.0;
  if (third < 0) return -1.0;
  const Vec3d a = Normalized(vertices[previous] - vertices[at]);
  const Vec3d b = Normalized(vertices[next] - vertices[at]);
  const Vec3d c = Normalized(vertices[third] - vertices[at]);
  return Determinant(a, b, c);
}

}  // namespace cell_law

AMHEX_HD inline OutwardFaces OutwardFacesOf(const CellCorners& corners) {
  // Outward rings of the cube's faces, the hexahedron's line of Figure 2; one digit per corner.
  constexpr uint16_t kRings[6] = {0x1230, 0x7654, 0x4510, 0x5621, 0x6732, 0x7403};
  OutwardFaces faces;
  for (const uint16_t ring : kRings) {
    OutwardFace face;
    for (int j = 0; j < 4; ++j) {
      const int32_t v = corners[ring >> (4 * j) & 7];
      if (v != corners[ring >> (4 * ((j + 1) % 4)) & 7]) face.v[face.count++] = v;
    }
    const bool folded = face.count == 4 && (face.v[0] == face.v[2] || face.v[1] == face.v[3]);
    if (face.count >= 3 && !folded) faces.face[faces.count++] = face;
  }
  return faces;
}

AMHEX_HD inline CellMeasures MeasureCell(const CellCorners& corners,
                                         ArrayView<const Vec3d> vertices) {
  std::array<Vec3d, 8> x;
  for (int i = 0; i < 8; ++i) x[i] = vertices[corners[i]];
  CellMeasures measures;
  measures.min_scaled_jacobian = 1.0;
  measures.min_map_jacobian = 1e300;
  const double gauss[2] = {0.5 - std::sqrt(1.0 / 12.0), 0.5 + std::sqrt(1.0 / 12.0)};
  for (int i = 0; i < 8; ++i) {
    const double jacobian =
        cell_law::MapJacobian(x, gauss[i & 1], gauss[i >> 1 & 1], gauss[i >> 2]);
    measures.volume += jacobian / 8;
    if (jacobian < measures.min_map_jacobian) measures.min_map_jacobian = jacobian;
  }
  for (int slot = 0; slot < 8; ++slot) {
    if (!cell_law::IsUncollapsed(corners, slot)) continue;
    const double jacobian =
        cell_law::MapJacobian(x, cell_law::PlaceOfSlot(slot, 0), cell_law::PlaceOfSlot(slot, 1),
                              cell_law::PlaceOfSlot(slot, 2));
    if (jacobian < measures.min_map_jacobian) measures.min_map_jacobian = jacobian;
  }
  const OutwardFaces faces = OutwardFacesOf(corners);
  for (const OutwardFace& face : faces) {
    for (int j = 0; j < face.count; ++j) {
      const double scaled = cell_law::ScaledJacobianAt(faces, face, j, vertices);
      if (scaled < measures.min_scaled_jacobian) measures.min_scaled_jacobian = scaled;
    }
  }
  return measures;
}

}  // namespace amhex
