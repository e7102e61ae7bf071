// What a cell's repeated corners mean, looked up once instead of derived at every evaluation.
//
// The 8 corners of a cell collapse along cube edges only (Figure 2), so the 12 equalities along
// the cube's edges name the pattern. Everything below is in corner slots 0..7 of that cell.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/volume_mesh.h"

namespace amhex {

struct CellPattern {
  PrimitiveType type = PrimitiveType::kHexahedron;

  int vertex_count = 0;
  std::array<uint8_t, 8> vertex_slot{};  // the first slot of each distinct vertex

  int edge_count = 0;
  std::array<std::array<uint8_t, 2>, 12> edge_slots{};

  // A vertex where exactly three edges meet; the three in right-handed order, as indices into
  // edge_slots. `sign` is the product of -1 for every edge stored towards the vertex instead of
  // away from it.
  struct Corner {
    uint8_t slot = 0;
    std::array<uint8_t, 3> edge{};
    double sign = 1;
  };
  int corner_count = 0;
  std::array<Corner, 8> corner{};

  // What a move of the vertex whose first slot is s changes: bit e of edges_at[s], edge e; bit i of
  // corners_at[s], corner i (one of its three edges).
  std::array<uint16_t, 8> edges_at{};
  std::array<uint8_t, 8> corners_at{};

  // Outward triangles of every face; both diagonals' two triangles of every quad.
  int triangle_count = 0;
  std::array<std::array<uint8_t, 3>, 24> triangle_slots{};

  // The same, number by number as lanes take them up (wide_cell.h): the slots that edges lead from
  // and to, the edges and signs of corners, the slots of triangles. Behind the last the first one
  // stands again.
  std::array<uint8_t, 16> edge_from{}, edge_to{};
  std::array<std::array<uint8_t, 8>, 3> corner_edge{};
  std::array<double, 8> corner_sign{};
  std::array<std::array<uint8_t, 24>, 3> triangle_corner{};
};

// All that FindCellPattern can answer.
const std::vector<CellPattern>& AllCellPatterns();

// nullptr if the corners form no cell of Figure 2. O(1), no allocation; safe from any thread.
const CellPattern* FindCellPattern(const CellCorners& corners);

// The same cell as an 8-corner list of Figure 2, up to turning. Tetrahedra, pyramids and slices
// also arise from other collapses of a cube than the listed ones; their corners are listed anew.
// Corners that form no cell come back as they are.
CellCorners AsListedInFigure2(const CellCorners& corners);

}  // namespace amhex
