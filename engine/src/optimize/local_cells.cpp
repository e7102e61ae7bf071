#include "optimize/local_cells.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace amhex {
namespace {

// Exponents below this are not worth evaluating.
constexpr double kNegligibleExponent = -6.0;
constexpr double kMaxExponent = 30.0;

// Cells with a smaller fold margin (a cube has 0.5, a regular tetrahedron 0.18) are watched, with a
// penalty that grows by a factor of e for every kFoldScale that the margin falls.
constexpr double kNearFolding = 0.04;
constexpr double kFoldScale = 0.008;
constexpr double kFoldWeight = 3.0;
constexpr double kMaxFoldExponent = 12.0;

// Step of the forward differences in mean edge lengths.
constexpr double kDifferenceStep = 1e-4;
constexpr size_t kCellsPerBlock = 256;

// exp(x) for |x| < 700 to about 1e-6, of the same bits on every machine: libm's own depends on the
// processor. 2^k times a Taylor polynomial on [-ln 2 / 2, ln 2 / 2].
double SteadyExp(double x) {
  constexpr double kLog2E = 1.4426950408889634, kLn2 = 0.6931471805599453;
  const int64_t k = static_cast<int64_t>(x * kLog2E + (x >= 0 ? 0.5 : -0.5));
  const double r = x - static_cast<double>(k) * kLn2;
  const double series =
      1 + r * (1 + r * (1.0 / 2 + r * (1.0 / 6 + r * (1.0 / 24 + r * (1.0 / 120 + r / 720)))));
  return series * std::bit_cast<double>((k + 1023) << 52);
}

double CornerEnergy(double s, const CornerPenalty& penalty) {
  const double deficit = 1 - s;
  const double exponent = penalty.steepness * (penalty.knee - s);
  if (!(exponent >= kNegligibleExponent)) return deficit * deficit;
  return deficit * deficit + SteadyExp(std::min(exponent, kMaxExponent));
}

// The 8-norm of deficits from the sum of their eighth powers. Square roots are exact to the bit on
// every processor.
double EighthPower(double deficit) {
  const double square = deficit * deficit;
  return square * square * (square * square);
}
double EighthRoot(double sum) { return std::sqrt(std::sqrt(std::sqrt(sum))); }

double FoldEnergy(double margin) {
  return kFoldWeight * SteadyExp(std::min(-margin / kFoldScale, kMaxFoldExponent)) - margin;
}

}  // namespace

CellSurvey SurveyCells(const CellComplex& complex, const VertexNeighbourhoods& neighbourhoods) {
  CellSurvey survey;
  survey.min_scaled_jacobian.resize(complex.cells.size());
  survey.near_folding.resize(complex.cells.size());
  std::vector<int32_t> all(complex.cells.size());
  std::iota(all.begin(), all.end(), 0);
  RenewSurvey(complex, neighbourhoods, all, survey);
  return survey;
}

void RenewSurvey(const CellComplex& complex, const VertexNeighbourhoods& neighbourhoods,
                 const std::vector<int32_t>& cells, CellSurvey& survey) {
  const auto survey_cell = [&](int32_t c) {
    const CellPattern& pattern = *neighbourhoods.patterns[c];
    std::array<Vec3d, 8> positions;
    for (int slot = 0; slot < 8; ++slot) positions[slot] = complex.vertices[complex.cells[c][slot]];
    CornerJacobians jacobians;
    ScaledJacobians(pattern, positions, jacobians);
    survey.min_scaled_jacobian[c] = static_cast<float>(
        *std::min_element(jacobians.begin(), jacobians.begin() + pattern.corner_count));
    survey.near_folding[c] = FoldMargin(pattern, positions) < kNearFolding;
  };
  tbb::parallel_for(tbb::blocked_range<size_t>(0, cells.size(), kCellsPerBlock),
                    [&](const tbb::blocked_range<size_t>& range) {
                      for (size_t i = range.begin(); i < range.end(); ++i) survey_cell(cells[i]);
                    });
}

LocalCells::LocalCells(const CellComplex& complex, const VertexNeighbourhoods& neighbourhoods,
                       int32_t vertex, const CornerPenalty& penalty,
                       const std::vector<uint8_t>& near_folding)
    : penalty_(penalty), position_(complex.vertices[vertex]) {
  for (const int32_t c : neighbourhoods.cells[vertex]) {
    Cell& cell = cells_.emplace_back();
    cell.pattern = neighbourhoods.patterns[c];
    cell.is_near_folding = !near_folding.empty() && near_folding[c] != 0;
    unsigned moving = 0;
    for (int slot = 0; slot < 8; ++slot) {
      const int32_t v = complex.cells[c][slot];
      cell.positions[slot] = complex.vertices[v];
      moving |= static_cast<unsigned>(v == vertex) << slot;
    }
    cell.moving_slots = static_cast<uint8_t>(moving);
    cell.first_slot = static_cast<uint8_t>(std::countr_zero(moving));
    for (int e = 0; e < cell.pattern->edge_count; ++e) UpdateEdge(e, cell);
    cell.fixed_minimum = 1;
    cell.fixed_deficits = 0;
    const unsigned moved_corners = cell.pattern->corners_at[cell.first_slot];
    for (int i = 0; i < cell.pattern->corner_count; ++i) {
      if (moved_corners >> i & 1) continue;
      const double jacobian = CornerJacobian(i, cell);
      cell.fixed_minimum = std::min(cell.fixed_minimum, jacobian);
      cell.fixed_deficits += EighthPower(1 - jacobian);
    }
  }
}

void LocalCells::UpdateEdge(int e, Cell& cell) {
  const auto& slots = cell.pattern->edge_slots[e];
  cell.directions[e] = Normalized(cell.positions[slots[1]] - cell.positions[slots[0]]);
}

double LocalCells::CornerJacobian(int i, const Cell& cell) {
  const CellPattern::Corner& corner = cell.pattern->corner[i];
  return corner.sign * Determinant(cell.directions[corner.edge[0]], cell.directions[corner.edge[1]],
                                   cell.directions[corner.edge[2]]);
}

void LocalCells::MoveTo(const Vec3d& position) {
  position_ = position;
  for (Cell& cell : cells_) {
    for (int slot = cell.first_slot; slot < 8; ++slot) {
      if (cell.moving_slots >> slot & 1) cell.positions[slot] = position;
    }
  }
}

LocalScore LocalCells::Score() {
  const bool of_minima = penalty_.kind == EnergyKind::kMinima;
  LocalScore score;
  for (Cell& cell : cells_) {
    const CellPattern& pattern = *cell.pattern;
    for (unsigned edges = pattern.edges_at[cell.first_slot]; edges != 0; edges &= edges - 1) {
      UpdateEdge(std::countr_zero(edges), cell);
    }
    double minimum = cell.fixed_minimum;
    double deficits = cell.fixed_deficits;
    for (unsigned corners = pattern.corners_at[cell.first_slot]; corners != 0;
         corners &= corners - 1) {
      const double jacobian = CornerJacobian(std::countr_zero(corners), cell);
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
    score.minimum = std::min(score.minimum, minimum);
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

Vec3d LocalCells::EnergyGradient(const std::array<Vec3d, 3>& axes, int axis_count,
                                 double energy_here) {
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
double LocalCells::MeanEdgeLength() const {
  double sum = 0;
  int count = 0;
  for (const Cell& cell : cells_) {
    for (unsigned edges = cell.pattern->edges_at[cell.first_slot]; edges != 0; edges &= edges - 1) {
      const auto& slots = cell.pattern->edge_slots[std::countr_zero(edges)];
      sum += Norm(cell.positions[slots[0]] - cell.positions[slots[1]]);
      ++count;
    }
  }
  return count > 0 ? sum / count : 0.0;
}

}  // namespace amhex
