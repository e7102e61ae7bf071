// The used primitives of Figure 2, as data: corner duplication, counts and faces.
//
// Vertices are renumbered 0..vertex_count-1 as in the corner pattern; faces are outward.
//
//   8 hexahedron      7 hexprism         6 prism           5 slice
//     7-----6           6-----5            5               3-----4
//    /|    /|          /|    /|           /| `.            |\  `.|   4 lies on edge 1-3
//   4-----5 |         3-----4 /          3-----4           | \   |   of the tetrahedron
//   | 3---|-2         | 2 `.|/           | 2 `.|           |  2 `|   0 1 2 3
//   |/    |/          |/    1            |/    1           |/    1
//   0-----1           0----'             0----'            0----'
//
//   4 pyramid: apex 0, base 1 2 4 3 (form a) or apex 1, base 2 0 3 4 (form b)
//   1 tetrahedron 0 1 2 3
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "amhex/volume_mesh.h"
#include "topology/primitives.h"

namespace amhex {

struct PrimitiveShape {
  PrimitiveType type;
  const char* name;
  CellCorners pattern;  // the collapsed edges of a hexahedron as repeated ids
  int vertex_count;
  int edge_count;
  int quad_count;
  int triangle_count;
  std::array<CellFace, 6> faces;  // quad_count + triangle_count of them

  constexpr int face_count() const { return quad_count + triangle_count; }
};

constexpr CellFace Quad(int32_t a, int32_t b, int32_t c, int32_t d) { return {4, {a, b, c, d}}; }
constexpr CellFace Triangle(int32_t a, int32_t b, int32_t c) { return {3, {a, b, c, -1}}; }

// A table, one shape per paragraph.
// clang-format off
inline constexpr std::array<PrimitiveShape, 7> kPrimitiveCatalog = {{
    // type, name, pattern, vertices, edges, quads, triangles, faces
    {PrimitiveType::kHexahedron, "hexahedron", {0, 1, 2, 3, 4, 5, 6, 7}, 8, 12, 6, 0,
     {Quad(0, 3, 2, 1), Quad(4, 5, 6, 7), Quad(0, 1, 5, 4), Quad(1, 2, 6, 5), Quad(2, 3, 7, 6),
      Quad(3, 0, 4, 7)}},
    {PrimitiveType::kHexprism, "hexprism", {0, 1, 1, 2, 3, 4, 5, 6}, 7, 11, 4, 2,
     {Triangle(0, 2, 1), Quad(3, 4, 5, 6), Quad(0, 1, 4, 3), Triangle(1, 5, 4), Quad(1, 2, 6, 5),
      Quad(2, 0, 3, 6)}},
    {PrimitiveType::kPrism, "prism", {0, 1, 1, 2, 3, 4, 4, 5}, 6, 9, 3, 2,
     {Triangle(0, 2, 1), Triangle(3, 4, 5), Quad(0, 1, 4, 3), Quad(1, 2, 5, 4), Quad(2, 0, 3, 5)}},
    {PrimitiveType::kSlice, "slice", {0, 1, 1, 2, 3, 4, 4, 3}, 5, 7, 2, 2,
     {Triangle(0, 2, 1), Quad(0, 1, 4, 3), Quad(1, 2, 3, 4), Triangle(2, 0, 3)}},
    {PrimitiveType::kPyramid, "pyramid, form a", {0, 1, 1, 2, 0, 3, 3, 4}, 5, 8, 1, 4,
     {Triangle(0, 2, 1), Triangle(0, 3, 4), Triangle(1, 3, 0), Quad(1, 2, 4, 3),
      Triangle(2, 0, 4)}},
    {PrimitiveType::kPyramid, "pyramid, form b", {0, 1, 1, 2, 3, 1, 1, 4}, 5, 8, 1, 4,
     {Triangle(0, 2, 1), Triangle(3, 1, 4), Triangle(0, 1, 3), Triangle(2, 4, 1),
      Quad(2, 0, 3, 4)}},
    {PrimitiveType::kTetrahedron, "tetrahedron", {0, 1, 1, 2, 0, 3, 3, 2}, 4, 6, 0, 4,
     {Triangle(0, 2, 1), Triangle(0, 3, 2), Triangle(1, 3, 0), Triangle(1, 2, 3)}},
}};
// clang-format on

// The first entry of that type.
const PrimitiveShape& ShapeOf(PrimitiveType type);

// The 8 corners of a primitive given by its faces, all seen from the same side: outward faces
// give the primitive, inward faces its mirror image. nullopt if the faces do not form the type.
std::optional<CellCorners> CornersFromFaces(PrimitiveType type, std::span<const CellFace> faces);

}  // namespace amhex
