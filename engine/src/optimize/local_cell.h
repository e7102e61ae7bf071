// A cell around a vertex that moves, copied close together, and what is asked of cells near
// folding; usable where bodies run.
#pragma once

#include <array>
#include <cstdint>

#include "optimize/cell_measures.h"
#include "optimize/corner_model.h"
#include "optimize/placement_view.h"

namespace amhex {

// One of the cells, with room for as many edges as it has at a vertex: together there is room for
// all distinct edges at the vertex.
struct LocalCell {
  static constexpr int kMostEdges = 4;  // of one cell at a vertex, an apex of a pyramid
  int32_t cell;
  uint8_t moving_slots;  // bit s: slot s is the vertex
  bool is_near_folding;
  double fixed_minimum;   // over the corners that the vertex does not move
  double fixed_deficits;  // sum of their deficits' powers
  // The corners at the far ends: their scaled Jacobians are normal * direction.
  int far_corner_count;
  std::array<int32_t, kMostEdges> far_edge;
  std::array<Vec3d, kMostEdges> far_normal;
  // The corner at the vertex; none where the sign is 0.
  double own_sign;
  std::array<int32_t, 3> own_edge;
  std::array<MovingEdge, kMostEdges> edges;
};

// A cell with one vertex, which may have several slots, in four places.
struct FourPlaces {
  const CellPattern& pattern;
  const CellPositions& positions;
  unsigned moving_slots;
  std::array<Vec3d, 4> places;
};
// What models ask of cells near folding.
struct FoldQuestions {
  // What FoldMargin is with the vertex in each of the places.
  AMHEX_HD std::array<double, 4> MarginsOf(const FourPlaces& of) const {
    std::array<double, 4> margins;
    for (int i = 0; i < 4; ++i) {
      CellPositions positions = of.positions;
      for (int slot = 0; slot < 8; ++slot) {
        if ((of.moving_slots >> slot & 1) != 0) positions[slot] = of.places[i];
      }
      margins[i] = FoldMargin(of.pattern, positions);
    }
    return margins;
  }
  // Of the edges at the vertex.
  template <class Cells>
  AMHEX_HD double MeanEdgeLengthOf(const Cells& cells) const {
    return cells.MeanEdgeLength();
  }
};

// Calls found(far vertex) for every edge of a cell at a vertex of it.
template <class Found>
AMHEX_HD void VisitEdgesAt(const PlacementView& placement, int32_t vertex, int32_t cell,
                           const Found& found) {
  const CellPattern& pattern = placement.PatternOf(cell);
  const CellCorners& corners = placement.cells[cell];
  int first_slot = 0;
  while (corners[first_slot] != vertex) ++first_slot;
  for (int e = 0; e < pattern.edge_count; ++e) {
    if ((pattern.edges_at[first_slot] >> e & 1) == 0) continue;
    const auto& slots = pattern.edge_slots[e];
    found(corners[corners[slots[0]] == vertex ? slots[1] : slots[0]]);
  }
}

}  // namespace amhex
