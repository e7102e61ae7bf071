// The cells around one vertex, copied close together, to be judged for many trial positions.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "assembly/cell_complex.h"
#include "optimize/cell_quality.h"
#include "optimize/vertex_neighbourhoods.h"

namespace amhex {

enum class EnergyKind : uint8_t {
  kCorners,  // the sum of every corner's penalty
  kMinima,   // per cell the 8-norm of its corners' deficits 1 - s: a smooth upper bound of the
             // deficit of its minimum, so that the sum follows the average of the minima
};

// Penalty of a scaled Jacobian s: (1 - s)^2 draws every corner towards 1;
// exp(steepness * (knee - s)) makes those below the knee dominate.
struct CornerPenalty {
  double knee = 0.25;
  double steepness = 15;
  EnergyKind kind = EnergyKind::kCorners;  // kMinima looks at neither number
};

struct LocalScore {
  double minimum = 1;  // least scaled Jacobian of all incident cells
  double energy = 0;   // smooth penalty of the corners that the vertex moves, or of its cells, and
                       // of cells that are close to folding
};

// What a sweep wants to know of every cell before it starts. Both follow from the positions of the
// cell's vertices alone.
struct CellSurvey {
  std::vector<float> min_scaled_jacobian;  // [cell_count]
  std::vector<uint8_t> near_folding;       // [cell_count] 1: the fold margin should be watched
};
CellSurvey SurveyCells(const CellComplex& complex, const VertexNeighbourhoods& neighbourhoods);
// Brings the entries of `cells` (no cell twice) up to date.
void RenewSurvey(const CellComplex& complex, const VertexNeighbourhoods& neighbourhoods,
                 const std::vector<int32_t>& cells, CellSurvey& survey);

class LocalCells {
 public:
  // `near_folding` of a survey, or empty to watch none.
  LocalCells(const CellComplex& complex, const VertexNeighbourhoods& neighbourhoods, int32_t vertex,
             const CornerPenalty& penalty, const std::vector<uint8_t>& near_folding);

  // Moves the vertex in the copies only.
  void MoveTo(const Vec3d& position);
  const Vec3d& position() const { return position_; }

  // Scaled Jacobians, and fold margins of the watched cells: cheap, for trials. Non-finite
  // positions give a minimum of -1.
  LocalScore Score();
  // Least FoldMargin of the incident cells: where it and the minimum are positive, all are valid.
  double WorstFoldMargin() const;
  // Gradient of the energy, which is `energy_here`, by forward differences along `axis_count` unit
  // axes.
  Vec3d EnergyGradient(const std::array<Vec3d, 3>& axes, int axis_count, double energy_here);

 private:
  struct Cell {
    const CellPattern* pattern;
    uint8_t moving_slots;  // bit s: slot s is the vertex
    uint8_t first_slot;    // the lowest of them
    bool is_near_folding;
    double fixed_minimum;   // over the corners that the vertex does not move
    double fixed_deficits;  // sum of their deficits' powers
    std::array<Vec3d, 8> positions;
    std::array<Vec3d, 12> directions;  // of the edges, unit
  };
  static void UpdateEdge(int e, Cell& cell);
  static double CornerJacobian(int i, const Cell& cell);
  double MeanEdgeLength() const;

  CornerPenalty penalty_;
  Vec3d position_;
  absl::InlinedVector<Cell, 10> cells_;
};

}  // namespace amhex
