// The cells of Figure 2: their patterns, faces, recognition and quality.
//
// Corner order is VTK_HEXAHEDRON's (volume_mesh.h). Cell patterns as 8-corner lists on renumbered
// vertices:
//   8 hexahedron   0 1 2 3 4 5 6 7
//   7 hexprism     0 1 1 2 3 4 5 6
//   6 prism        0 1 1 2 3 4 4 5
//   5 slice        0 1 1 2 3 4 4 3
//   4 pyramid      0 1 1 2 0 3 3 4  (apex 0)   or   0 1 1 2 3 1 1 4  (apex 1)
//   1 tetrahedron  0 1 1 2 0 3 3 2
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"

namespace amhex {

// Cube faces by direction -x +x -y +y -z +z, corners outward (counter-clockwise from outside).
inline constexpr std::array<std::array<int, 4>, 6> kCubeFaces = {
    {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}};

// The twelve cube edges as corner pairs.
inline constexpr std::array<std::array<int, 2>, 12> kCubeEdges = {{{0, 1},
                                                                   {1, 2},
                                                                   {2, 3},
                                                                   {3, 0},
                                                                   {4, 5},
                                                                   {5, 6},
                                                                   {6, 7},
                                                                   {7, 4},
                                                                   {0, 4},
                                                                   {1, 5},
                                                                   {2, 6},
                                                                   {3, 7}}};

// A triangle or quad of vertex ids; `v[3]` is -1 on triangles.
struct CellFace {
  int count = 0;  // 3 or 4
  std::array<int32_t, 4> v{-1, -1, -1, -1};
};

// Up to six outward faces of a cell after its collapses.
struct CellFaces {
  int count = 0;
  std::array<CellFace, 6> face;
  const CellFace* begin() const { return face.data(); }
  const CellFace* end() const { return face.data() + count; }
};

CellFaces FacesOf(const CellCorners& corners);

// The face that looks in `direction` (0..5); its count is 0 if it has collapsed away.
CellFace FaceInDirection(const CellCorners& corners, int direction);

// Distinct vertices in order of first appearance.
struct CellVertices {
  int count = 0;
  std::array<int32_t, 8> v{};
  const int32_t* begin() const { return v.data(); }
  const int32_t* end() const { return v.data() + count; }
};
CellVertices VerticesOf(const CellCorners& corners);

// The type whose face structure the collapsed corners have, or nullopt for prysm, tie, pillow and
// everything else that is no cell of ours.
std::optional<PrimitiveType> RecognizeCell(const CellCorners& corners);

// Builders in canonical patterns. Vertex order as documented per pattern above.
CellCorners MakeTetrahedron(int32_t v0, int32_t v1, int32_t v2, int32_t v3);
// Base quad counter-clockwise seen from outside the cell (its outward order); apex on the far side.
CellCorners MakePyramid(const std::array<int32_t, 4>& base_outward, int32_t apex);
// Tetrahedron from its outward base triangle and apex.
CellCorners MakeTetrahedronOn(const std::array<int32_t, 3>& base_outward, int32_t apex);

// Minimum scaled Jacobian over the corners where exactly three edges meet (section 5.2); 1 is
// perfect, <= 0 is inverted.
double ScaledJacobian(const CellCorners& corners, const std::vector<Vec3d>& vertices);

// Exact volume of the trilinear map (2x2x2 Gauss points).
double CellVolume(const CellCorners& corners, const std::vector<Vec3d>& vertices);

// True if every triangle of both diagonals of every face is seen from the inside of the vertex
// average: stronger than positive Jacobians; used when cells are accepted.
bool IsStarShaped(const CellCorners& corners, const std::vector<Vec3d>& vertices);

}  // namespace amhex
