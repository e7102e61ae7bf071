#include "optimize/local_cells.h"

#include <algorithm>
#include <cmath>

namespace amhex {
namespace {

// Exponents below this are not worth evaluating.
constexpr double kNegligibleExponent = -6.0;
constexpr double kMaxExponent = 30.0;

double CornerEnergy(double s, const CornerPenalty& penalty) {
  const double deficit = 1 - s;
  const double exponent = penalty.steepness * (penalty.knee - s);
  if (exponent < kNegligibleExponent) return deficit * deficit;
  return deficit * deficit + std::exp(std::min(exponent, kMaxExponent));
}

// Cells with a smaller fold margin (a cube has 0.5, a regular tetrahedron 0.18) are watched, with a
// penalty that grows by a factor of e for every kFoldScale that the margin falls.
constexpr double kNearFolding = 0.04;
constexpr double kFoldScale = 0.008;
constexpr double kFoldWeight = 3.0;
constexpr double kMaxFoldExponent = 12.0;

double FoldEnergy(double margin) {
  return kFoldWeight * std::exp(std::min(-margin / kFoldScale, kMaxFoldExponent)) - margin;
}

// Step of the forward differences in mean edge lengths.
constexpr double kDifferenceStep = 1e-4;

}  // namespace

LocalCells::LocalCells(const CellComplex& complex, const VertexNeighbourhoods& neighbourhoods,
                       int32_t vertex, const CornerPenalty& penalty)
    : penalty_(penalty), position_(complex.vertices[vertex]) {
  for (const int32_t c : neighbourhoods.cells[vertex]) {
    Cell& cell = cells_.emplace_back();
    cell.pattern = neighbourhoods.patterns[c];
    cell.moving_slots = 0;
    for (int slot = 0; slot < 8; ++slot) {
      const int32_t v = complex.cells[c][slot];
      cell.positions[slot] = complex.vertices[v];
      if (v == vertex) cell.moving_slots = static_cast<uint8_t>(cell.moving_slots | 1 << slot);
    }
    cell.near_folding = FoldMargin(*cell.pattern, cell.positions) < kNearFolding;
  }
}

void LocalCells::MoveTo(const Vec3d& position) {
  position_ = position;
  for (Cell& cell : cells_) {
    for (int slot = 0; slot < 8; ++slot) {
      if (cell.moving_slots >> slot & 1) cell.positions[slot] = position;
    }
  }
}

LocalScore LocalCells::Score() const {
  LocalScore score;
  CornerJacobians jacobians;
  for (const Cell& cell : cells_) {
    ScaledJacobians(*cell.pattern, cell.positions, jacobians);
    double minimum = 1;
    for (int i = 0; i < cell.pattern->corner_count; ++i) {
      // Written so that NaN lowers the minimum too.
      if (!(jacobians[i] >= minimum)) minimum = std::isnan(jacobians[i]) ? -1 : jacobians[i];
      score.energy += CornerEnergy(jacobians[i], penalty_);
    }
    if (cell.near_folding) score.energy += FoldEnergy(FoldMargin(*cell.pattern, cell.positions));
    score.minimum = std::min(score.minimum, minimum);
    score.sum += minimum;
  }
  return score;
}

double LocalCells::WorstFoldMargin() const {
  double worst = 1;
  for (const Cell& cell : cells_) {
    worst = std::min(worst, FoldMargin(*cell.pattern, cell.positions));
  }
  return worst;
}

Vec3d LocalCells::EnergyGradient(const std::array<Vec3d, 3>& axes, int axis_count) {
  const Vec3d start = position_;
  const double step = kDifferenceStep * MeanEdgeLength();
  const double at_start = Score().energy;
  Vec3d gradient;
  for (int a = 0; a < axis_count; ++a) {
    MoveTo(start + axes[a] * step);
    gradient += axes[a] * ((Score().energy - at_start) / step);
  }
  MoveTo(start);
  return gradient;
}

Vec3d LocalCells::NeighbourMean() const {
  Vec3d sum;
  int count = 0;
  for (const Cell& cell : cells_) {
    for (int e = 0; e < cell.pattern->edge_count; ++e) {
      const auto [a, b] = cell.pattern->edge_slots[e];
      const bool from = cell.moving_slots >> a & 1, to = cell.moving_slots >> b & 1;
      if (from == to) continue;
      sum += cell.positions[from ? b : a];
      ++count;
    }
  }
  return count > 0 ? sum / count : position_;
}

double LocalCells::MeanEdgeLength() const {
  double sum = 0;
  int count = 0;
  for (const Cell& cell : cells_) {
    for (int e = 0; e < cell.pattern->edge_count; ++e) {
      const auto [a, b] = cell.pattern->edge_slots[e];
      if ((cell.moving_slots >> a & 1) == (cell.moving_slots >> b & 1)) continue;
      sum += Norm(cell.positions[a] - cell.positions[b]);
      ++count;
    }
  }
  return count > 0 ? sum / count : 0.0;
}

}  // namespace amhex
