// The cells around one vertex, copied close together, to be judged for many trial positions; usable
// where bodies run.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "base/array_view.h"
#include "optimize/cell_measures.h"
#include "optimize/placement_view.h"

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

// Whether cells that the survey says are near folding add to the energy.
enum class FoldWatch : uint8_t { kNone, kSurvey };

// One of the cells.
struct LocalCell {
  const CellPattern* pattern;
  uint8_t moving_slots;  // bit s: slot s is the vertex
  uint8_t first_slot;    // the lowest of them
  bool is_near_folding;
  double fixed_minimum;   // over the corners that the vertex does not move
  double fixed_deficits;  // sum of their deficits' powers
  CellPositions positions;
  std::array<Vec3d, 12> directions;  // of the edges, unit
};

class LocalCells {
 public:
  // Room for as many cells as there are at the vertex; must outlive this.
  AMHEX_HD LocalCells(const PlacementView& placement, int32_t vertex, const CornerPenalty& penalty,
                      FoldWatch watch, LocalCell* room);

  // Moves the vertex in the copies only.
  AMHEX_HD void MoveTo(const Vec3d& position);
  AMHEX_HD const Vec3d& position() const { return position_; }

  // Scaled Jacobians, and fold margins of the watched cells: cheap, for trials. Non-finite
  // positions give a minimum of -1.
  AMHEX_HD LocalScore Score();
  // Least FoldMargin of the incident cells: where it and the minimum are positive, all are valid.
  AMHEX_HD double WorstFoldMargin() const;
  // Gradient of the energy, which is `energy_here`, by forward differences along `axis_count` unit
  // axes.
  AMHEX_HD Vec3d EnergyGradient(const std::array<Vec3d, 3>& axes, int axis_count,
                                double energy_here);

 private:
  AMHEX_HD void SetCell(const PlacementView& placement, int32_t vertex, int32_t c, LocalCell& cell);
  AMHEX_HD static void UpdateEdge(int e, LocalCell& cell);
  AMHEX_HD static double CornerJacobian(int i, const LocalCell& cell);
  AMHEX_HD double MeanEdgeLength() const;

  CornerPenalty penalty_;
  Vec3d position_;
  ArrayView<LocalCell> cells_;
};

// exp(x) for |x| < 700 to about 1e-6, of the same bits on every machine: libm's own depends on the
// processor. 2^k times a Taylor polynomial on [-ln 2 / 2, ln 2 / 2].
AMHEX_HD inline double SteadyExp(double x) {
  constexpr double kLog2E = 1.4426950408889634, kLn2 = 0.6931471805599453;
  const int64_t k = static_cast<int64_t>(x * kLog2E + (x >= 0 ? 0.5 : -0.5));
  const double r = x - static_cast<double>(k) * kLn2;
  const double series =
      1 + r * (1 + r * (1.0 / 2 + r * (1.0 / 6 + r * (1.0 / 24 + r * (1.0 / 120 + r / 720)))));
  return series * std::bit_cast<double>((k + 1023) << 52);
}

AMHEX_HD inline double CornerEnergy(double s, const CornerPenalty& penalty) {
  // Exponents below this are not worth evaluating.
  constexpr double kNegligibleExponent = -6.0;
  constexpr double kMaxExponent = 30.0;
  const double deficit = 1 - s;
  const double exponent = penalty.steepness * (penalty.knee - s);
  if (!(exponent >= kNegligibleExponent)) return deficit * deficit;
  return deficit * deficit + SteadyExp(Smaller(exponent, kMaxExponent));
}

// The 8-norm of deficits from the sum of their eighth powers. Square roots are exact to the bit on
// every processor.
AMHEX_HD inline double EighthPower(double deficit) {
  const double square = deficit * deficit;
  return square * square * (square * square);
}
AMHEX_HD inline double EighthRoot(double sum) { return std::sqrt(std::sqrt(std::sqrt(sum))); }

// Cells with a smaller fold margin (a cube has 0.5, a regular tetrahedron 0.18) are watched, with a
// penalty that grows by a factor of e for every scale that the margin falls.
inline constexpr double kNearFolding = 0.04;
AMHEX_HD inline double FoldEnergy(double margin) {
  constexpr double kFoldScale = 0.008;
  constexpr double kFoldWeight = 3.0;
  constexpr double kMaxFoldExponent = 12.0;
  return kFoldWeight * SteadyExp(Smaller(-margin / kFoldScale, kMaxFoldExponent)) - margin;
}

// Brings the survey of one cell up to date.
AMHEX_HD inline void SurveyCell(const PlacementView& placement, int64_t c) {
  const CellPattern& pattern = placement.PatternOf(c);
  CellPositions positions;
  for (int slot = 0; slot < 8; ++slot)
    positions[slot] = placement.vertices[placement.cells[c][slot]];
  CornerJacobians jacobians;
  ScaledJacobians(pattern, positions, jacobians);
  double minimum = jacobians[0];
  for (int i = 1; i < pattern.corner_count; ++i) {
    if (jacobians[i] < minimum) minimum = jacobians[i];
  }
  placement.min_scaled_jacobian[c] = static_cast<float>(minimum);
  placement.near_folding[c] = FoldMargin(pattern, positions) < kNearFolding;
}

AMHEX_HD inline LocalCells::LocalCells(const PlacementView& placement, int32_t vertex,
                                       const CornerPenalty& penalty, FoldWatch watch,
                                       LocalCell* room)
    : penalty_(penalty), position_(placement.vertices[vertex]) {
  const ArrayView<const int32_t> row = placement.cells_at[vertex];
  cells_ = {room, row.size};
  for (int64_t k = 0; k < row.size; ++k) {
    SetCell(placement, vertex, row[k], cells_[k]);
    cells_[k].is_near_folding = watch == FoldWatch::kSurvey && placement.near_folding[row[k]] != 0;
  }
}

AMHEX_HD inline void LocalCells::SetCell(const PlacementView& placement, int32_t vertex, int32_t c,
                                         LocalCell& cell) {
  cell.pattern = &placement.PatternOf(c);
  unsigned moving = 0;
  for (int slot = 0; slot < 8; ++slot) {
    const int32_t v = placement.cells[c][slot];
    cell.positions[slot] = placement.vertices[v];
    moving |= static_cast<unsigned>(v == vertex) << slot;
  }
  cell.moving_slots = static_cast<uint8_t>(moving);
  cell.first_slot = static_cast<uint8_t>(LowestBit(moving));
  for (int e = 0; e < cell.pattern->edge_count; ++e) UpdateEdge(e, cell);
  cell.fixed_minimum = 1;
  cell.fixed_deficits = 0;
  const unsigned moved_corners = cell.pattern->corners_at[cell.first_slot];
  for (int i = 0; i < cell.pattern->corner_count; ++i) {
    if (moved_corners >> i & 1) continue;
    const double jacobian = CornerJacobian(i, cell);
    cell.fixed_minimum = jacobian < cell.fixed_minimum ? jacobian : cell.fixed_minimum;
    cell.fixed_deficits += EighthPower(1 - jacobian);
  }
}

AMHEX_HD inline void LocalCells::UpdateEdge(int e, LocalCell& cell) {
  const auto& slots = cell.pattern->edge_slots[e];
  cell.directions[e] = Normalized(cell.positions[slots[1]] - cell.positions[slots[0]]);
}

AMHEX_HD inline double LocalCells::CornerJacobian(int i, const LocalCell& cell) {
  const CellPattern::Corner& corner = cell.pattern->corner[i];
  return corner.sign * Determinant(cell.directions[corner.edge[0]], cell.directions[corner.edge[1]],
                                   cell.directions[corner.edge[2]]);
}

AMHEX_HD inline void LocalCells::MoveTo(const Vec3d& position) {
  position_ = position;
  for (int64_t k = 0; k < cells_.size; ++k) {
    LocalCell& cell = cells_[k];
    for (int slot = cell.first_slot; slot < 8; ++slot) {
      if (cell.moving_slots >> slot & 1) cell.positions[slot] = position;
    }
  }
}

AMHEX_HD inline LocalScore LocalCells::Score() {
  const bool of_minima = penalty_.kind == EnergyKind::kMinima;
  LocalScore score;
  for (int64_t k = 0; k < cells_.size; ++k) {
    LocalCell& cell = cells_[k];
    const CellPattern& pattern = *cell.pattern;
    for (unsigned edges = pattern.edges_at[cell.first_slot]; edges != 0; edges &= edges - 1) {
      UpdateEdge(LowestBit(edges), cell);
    }
    double minimum = cell.fixed_minimum;
    double deficits = cell.fixed_deficits;
    for (unsigned corners = pattern.corners_at[cell.first_slot]; corners != 0;
         corners &= corners - 1) {
      const double jacobian = CornerJacobian(LowestBit(corners), cell);
      // Written so that not-a-number lowers the minimum too.
      if (!(jacobian >= minimum)) minimum = std::isnan(jacobian) ? -1 : jacobian;
      if (of_minima) {
        deficits += EighthPower(1 - jacobian);
      } else {
        score.energy += CornerEnergy(jacobian, penalty_);
      }
    }
    if (of_minima) score.energy += EighthRoot(deficits);
    if (cell.is_near_folding) score.energy += FoldEnergy(FoldMargin(pattern, cell.positions));
    score.minimum = minimum < score.minimum ? minimum : score.minimum;
  }
  return score;
}

AMHEX_HD inline double LocalCells::WorstFoldMargin() const {
  double worst = 1;
  for (int64_t k = 0; k < cells_.size; ++k) {
    const double margin = FoldMargin(*cells_[k].pattern, cells_[k].positions);
    worst = margin < worst ? margin : worst;
  }
  return worst;
}

AMHEX_HD inline Vec3d LocalCells::EnergyGradient(const std::array<Vec3d, 3>& axes, int axis_count,
                                                 double energy_here) {
  // Step of the forward differences in mean edge lengths.
  constexpr double kDifferenceStep = 1e-4;
  const Vec3d start = position_;
  const double step = kDifferenceStep * MeanEdgeLength();
  Vec3d gradient;
  for (int a = 0; a < axis_count; ++a) {
    MoveTo(start + axes[a] * step);
    gradient += axes[a] * ((Score().energy - energy_here) / step);
  }
  MoveTo(start);
  return gradient;
}

// Over the cell edges at the vertex.
AMHEX_HD inline double LocalCells::MeanEdgeLength() const {
  double sum = 0;
  int count = 0;
  for (int64_t k = 0; k < cells_.size; ++k) {
    const LocalCell& cell = cells_[k];
    for (unsigned edges = cell.pattern->edges_at[cell.first_slot]; edges != 0; edges &= edges - 1) {
      const auto& slots = cell.pattern->edge_slots[LowestBit(edges)];
      sum += Norm(cell.positions[slots[0]] - cell.positions[slots[1]]);
      ++count;
    }
  }
  return count > 0 ? sum / count : 0.0;
}

}  // namespace amhex
