// How one cell falls apart into tetrahedra, pyramids, prisms and hexahedra, when some of its
// quadrilaterals are to be split in two.
#pragma once

#include <array>
#include <vector>

#include "amhex/volume_mesh.h"
#include "cells/cells.h"

namespace amhex::client {

// How a quadrilateral is split; said by vertex numbers, so that both of its cells mean the same.
enum class Diagonal : uint8_t {
  kNone = 0,
  kThroughLeast = 1,  // joins the vertex of least number and the one opposite
  kBesideLeast = 2,   // joins the other two
};

// The diagonal of `quad` that ends at `vertex`.
Diagonal DiagonalThrough(const Face& quad, int32_t vertex);

// One entry per face of the cell; triangles have kNone.
using FaceDiagonals = std::array<Diagonal, 6>;

// Stands in `Division::cells` for the vertex that lies at `Division::centre`.
inline constexpr int32_t kCentreVertex = -1;

struct Division {
  std::vector<CellCorners> cells;
  bool has_centre = false;
  Vec3d centre;
  // Least scaled Jacobian of `cells`; with a vanishing or negative volume never above 0.
  double quality = -1;
};

// The division of best quality that splits exactly the quadrilaterals that `diagonals` splits,
// out of these: the cell itself, if nothing is split and it is a hexahedron, prism, pyramid or
// tetrahedron; the fan of its faces from one of its vertices; a hexprism as a pyramid and a prism;
// and the fan from a new vertex inside, which exists whatever is split, except that a slice needs
// one of its quadrilaterals split: they share two edges, and so the vertex between these sees
// one of the two pyramids over them inside out. A slice with both split beside that vertex becomes
// one tetrahedron, and the cells on its two sides meet in the triangle that it leaves.
Division DivideCell(const CellCorners& corners, const std::vector<Vec3d>& vertices,
                    const FaceDiagonals& diagonals);

// The diagonals that the divisions of a hexprism without new vertex need, as entries of its faces:
// first those of the fan from the vertex in which its triangles meet, then those that cut
// it into a pyramid and a prism.
std::array<FaceDiagonals, 2> HexprismDiagonals(const FaceList& faces);

}  // namespace amhex::client
