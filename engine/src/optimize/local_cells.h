// The cells around one vertex, copied close together, to be judged for many trial positions.
#pragma once

#include <array>
#include <cstdint>

#include "absl/container/inlined_vector.h"
#include "assembly/cell_complex.h"
#include "optimize/cell_quality.h"
#include "optimize/vertex_neighbourhoods.h"

namespace amhex {

// Penalty of a scaled Jacobian s: (1 - s)^2 draws every corner towards 1;
// exp(steepness * (knee - s)) makes those below the knee dominate.
struct CornerPenalty {
  double knee = 0.25;
  double steepness = 15;
};

struct LocalScore {
  double minimum = 1;  // least scaled Jacobian of all incident cells
  double sum = 0;      // of the incident cells' minimum scaled Jacobians
  double energy = 0;   // smooth penalty of low corners and of cells that are close to folding
};

class LocalCells {
 public:
  LocalCells(const CellComplex& complex, const VertexNeighbourhoods& neighbourhoods, int32_t vertex,
             const CornerPenalty& penalty);

  // Moves the vertex in the copies only.
  void MoveTo(const Vec3d& position);
  const Vec3d& position() const { return position_; }

  // Scaled Jacobians, and fold margins of the cells that were close to folding at the start: cheap,
  // for trials. NaN positions give a minimum of -1.
  LocalScore Score() const;
  // Least FoldMargin of the incident cells: where it and the minimum are positive, all are valid.
  double WorstFoldMargin() const;
  // Gradient of the energy by forward differences along `axis_count` unit axes, as a vector.
  Vec3d EnergyGradient(const std::array<Vec3d, 3>& axes, int axis_count);

  // Mean of the vertices joined to this one by cell edges.
  Vec3d NeighbourMean() const;
  // Mean length of the cell edges at the vertex.
  double MeanEdgeLength() const;

 private:
  struct Cell {
    const CellPattern* pattern;
    uint8_t moving_slots;  // bit s: slot s is the vertex
    bool near_folding;
    std::array<Vec3d, 8> positions;
  };
  CornerPenalty penalty_;
  Vec3d position_;
  absl::InlinedVector<Cell, 12> cells_;
};

}  // namespace amhex
