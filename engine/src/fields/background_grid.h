// The cubic grid of nodes that carries the fields: inside cells of spacing h / 2, what the hull
// demands of those next to it, and a pyramid of coarser levels.
//
// Stored by nodes only, in Morton order: memory follows the volume inside, not the bounding box,
// and neighbours in space are neighbours in memory.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "fields/field_loops.h"
#include "fields/grid_keys.h"
#include "fields/grid_neighbours.h"
#include "fields/hull_constraint.h"
#include "fields/owned_hull_nodes.h"
#include "input/ask_hull.h"
#include "input/hull.h"

namespace amhex::fields {

// One level of the pyramid; arrays have one entry per node.
struct GridLevel {
  std::vector<uint64_t> key;                                     // Morton code of the cell
  std::vector<std::array<int32_t, kNeighbourCount>> neighbours;  // -1 = not inside
  // Summed weights of the fine edges that join the two cells; empty on the finest level, where
  // they are kAxisWeight and kDiagonalWeight.
  std::vector<std::array<float, kNeighbourCount>> weights;
  std::vector<int32_t> parent;  // node of the next coarser level; empty on the last
  // Finest level only: what the hull demands of the nodes next to it, and each node's place among
  // them, -1 = away from the hull.
  OwnedHullNodes at_hull;
  std::vector<int32_t> place_at_hull;
  // Likewise, directions of the user's guidance, whose points mean nothing; empty without guidance.
  std::vector<int32_t> guides_of_node;
  std::vector<HullConstraints> guides;
  // Nodes by the parity of their cell: no two neighbours share a colour.
  std::array<std::vector<int32_t>, 8> colours;

  int64_t count() const { return static_cast<int64_t>(key.size()); }
  // Empty away from the hull.
  std::span<const HullConstraint> ConstraintsOf(int64_t node) const {
    const int32_t place = place_at_hull[node];
    if (place < 0) return {};
    const HullConstraint* const all = at_hull.constraints.data();
    return {all + at_hull.first[place], all + at_hull.first[place + 1]};
  }
  const HullConstraints* GuidesOf(int64_t node) const {
    if (guides_of_node.empty() || guides_of_node[node] < 0) return nullptr;
    return &guides[guides_of_node[node]];
  }
};

struct BackgroundGrid {
  double spacing = 1.0 / kNodesPerEdge;  // edge lengths
  Vec3d origin;                          // lower corner of cell (0, 0, 0)
  std::vector<GridLevel> levels;         // finest first
  mutable ResidentSlot cells_there;      // of the finest level's keys

  const GridLevel& fine() const { return levels.front(); }
  int64_t count() const { return fine().count(); }
  // Those of the finest level, which a device keeps.
  CellCentres Cells() const {
    CellCentres cells = CentresOf(fine().key, origin, spacing);
    cells.resident = &cells_there;
    return cells;
  }
  Vec3d Position(int64_t node) const;  // centre of the finest cell
};

// All levels of the inside of `hull`, nodes `spacing` apart (edge lengths). INVALID_ARGUMENT when
// no node lies inside, RESOURCE_EXHAUSTED when the box needs more than 2^20 cells along an axis or
// 2^31 nodes. `device` answers what the hull is asked; null = the CPU. O(nodes log triangles).
absl::StatusOr<BackgroundGrid> BuildBackgroundGrid(const Hull& hull, double spacing,
                                                   const ProgressSlice& slice,
                                                   DeviceUse* device = nullptr);

// The single steps, for tests.
// Sorted Morton codes of the inside cells (grid_cells.cpp).
absl::StatusOr<std::vector<uint64_t>> FindInsideCells(const HullAsker& hull, const Vec3d& origin,
                                                      double spacing, int depth);
// Fills at_hull and place_at_hull of the finest level (hull_constraints.cpp).
absl::Status FindHullConstraints(const HullAsker& hull, BackgroundGrid* grid);
// Fills guides_of_node and guides of the finest level (guide_directions.cpp).
absl::Status FindGuideDirections(const Guidance& guidance, BackgroundGrid* grid,
                                 const RunContext& run);
// Adds the coarser levels, then neighbours and colours of all (grid_pyramid.cpp).
absl::Status BuildPyramid(BackgroundGrid* grid, const RunContext& run);

}  // namespace amhex::fields
