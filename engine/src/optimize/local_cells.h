// The cells around one vertex, copied close together, to be judged for many trial positions; usable
// where bodies run.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "base/array_view.h"
#include "optimize/cell_energy.h"
#include "optimize/cell_measures.h"
#include "optimize/corner_model.h"
#include "optimize/local_cell.h"
#include "optimize/placement_view.h"

namespace amhex {

struct LocalScore {
  double minimum = 1;  // least scaled Jacobian of all incident cells
  double energy = 0;   // smooth penalty of the corners that the vertex moves, or of its cells, and
                       // of cells that are close to folding
};

// Whether cells that the survey says are near folding add to the energy.
enum class FoldWatch : uint8_t { kNone, kSurvey };

class LocalCells {
 public:
  // Room for as many cells as there are at the vertex; must outlive this.
  AMHEX_HD LocalCells(const PlacementView& placement, int32_t vertex, const CornerPenalty& penalty,
                      FoldWatch watch, LocalCell* room)
      : LocalCells(placement, vertex, penalty, watch, room, placement.cells_at[vertex]) {}
  // Only the given ones of the cells at the vertex.
  AMHEX_HD LocalCells(const PlacementView& placement, int32_t vertex, const CornerPenalty& penalty,
                      FoldWatch watch, LocalCell* room, ArrayView<const int32_t> cells);
  // Only those whose numbers are in the room, which is for them alone. Somebody else must know the
  // mean length of all edges at the vertex.
  AMHEX_HD LocalCells(const PlacementView& placement, int32_t vertex, const CornerPenalty& penalty,
                      FoldWatch watch, ArrayView<LocalCell> cells);

  // Moves the vertex in the copies only.
  AMHEX_HD void MoveTo(const Vec3d& position);
  AMHEX_HD const Vec3d& position() const { return position_; }

  // Scaled Jacobians, and fold margins of the watched cells: cheap, for trials. Non-finite
  // positions give a minimum of -1.
  AMHEX_HD LocalScore Score();
  // Least FoldMargin of the incident cells: where it and the minimum are positive, all are valid.
  AMHEX_HD double WorstFoldMargin() const;
  // The energy around the position last scored. What curves it beyond the corners' own deficits is
  // left out where it would make it fall, so that -hessian^-1 gradient always leads downhill.
  AMHEX_HD EnergyModel Model() const;

  // The same, cell by cell. Score is RenewEdges, then what every cell adds.
  AMHEX_HD int64_t count() const { return cells_.size; }
  AMHEX_HD void RenewEdges();
  AMHEX_HD void AddScore(int64_t k, LocalScore& score) const;
  // `folds` as FoldQuestions.
  template <class Folds>
  AMHEX_HD void AddModel(int64_t k, const Folds& folds, EnergyModel& model) const;
  // And summand by summand: those of a cell, which are added one after the other.
  static constexpr int kMostSummands = LocalCell::kMostEdges + 2;
  // Calls add(part of the energy) for each; returns the cell's least scaled Jacobian.
  template <class Add>
  AMHEX_HD double VisitScore(int64_t k, const Add& add) const;
  AMHEX_HD int ModelSummands(int64_t k) const;
  template <class Folds>
  AMHEX_HD void AddModelSummand(int64_t k, int summand, const Folds& folds,
                                EnergyModel& model) const;
  AMHEX_HD bool IsNearFolding(int64_t k) const { return cells_[k].is_near_folding; }
  AMHEX_HD double FoldMarginOf(int64_t k) const { return MarginAt(cells_[k], position_); }
  // Over the edges at the vertex.
  AMHEX_HD double MeanEdgeLength() const;

  // Whether the condition holds for all of 0 .. count-1, beginning with `first`.
  template <class Condition>
  AMHEX_HD bool HoldForAll(int64_t count, int64_t first, const Condition& holds) const {
    for (int64_t i = 0; i < count; ++i) {
      if (!holds((first + i) % count)) return false;
    }
    return true;
  }

 private:
  AMHEX_HD void SetCell(int32_t vertex, LocalCell& cell);
  AMHEX_HD void AddAllEdges(int32_t vertex);
  AMHEX_HD int32_t EdgeTo(int32_t far_vertex);
  AMHEX_HD MovingEdge& EdgeAt(int32_t e) const {
    return cells_.data[e / LocalCell::kMostEdges].edges[e % LocalCell::kMostEdges];
  }
  // The corners that the vertex moves: those at far ends, then its own.
  AMHEX_HD static int CornerCount(const LocalCell& cell) {
    return cell.far_corner_count + (cell.own_sign != 0 ? 1 : 0);
  }
  AMHEX_HD double JacobianOf(const LocalCell& cell, int corner) const {
    if (corner < cell.far_corner_count) {
      return Dot(cell.far_normal[corner], EdgeAt(cell.far_edge[corner]).direction);
    }
    return cell.own_sign * Determinant(EdgeAt(cell.own_edge[0]).direction,
                                       EdgeAt(cell.own_edge[1]).direction,
                                       EdgeAt(cell.own_edge[2]).direction);
  }
  AMHEX_HD double DeficitPower(double jacobian) const {
    return SquaredTimes(1 - jacobian, penalty_.sharpness);
  }
  AMHEX_HD CornerModel<Vec3d> ModelOf(const LocalCell& cell, int corner) const;
  AMHEX_HD CellPositions PositionsOf(const LocalCell& cell, const Vec3d& position) const;
  AMHEX_HD double MarginAt(const LocalCell& cell, const Vec3d& position) const;
  AMHEX_HD void AddMinimum(const LocalCell& cell, EnergyModel& model) const;
  template <class Folds>
  AMHEX_HD void AddFold(const LocalCell& cell, const Folds& folds, EnergyModel& model) const;

  const PlacementView& placement_;
  CornerPenalty penalty_;
  Vec3d position_;
  ArrayView<LocalCell> cells_;
  int32_t edge_count_ = 0;
};

AMHEX_HD inline LocalCells::LocalCells(const PlacementView& placement, int32_t vertex,
                                       const CornerPenalty& penalty, FoldWatch watch,
                                       LocalCell* room, ArrayView<const int32_t> cells)
    : placement_(placement),
      penalty_(penalty),
      position_(placement.vertices[vertex]),
      cells_{room, cells.size} {
  bool is_any_near_folding = false;
  for (int64_t k = 0; k < cells.size; ++k) {
    cells_[k].cell = cells[k];
    cells_[k].is_near_folding =
        watch == FoldWatch::kSurvey && placement.near_folding[cells[k]] != 0;
    is_any_near_folding |= cells_[k].is_near_folding;
  }
  if (is_any_near_folding && cells.size < placement.cells_at[vertex].size) AddAllEdges(vertex);
  for (int64_t k = 0; k < cells.size; ++k) SetCell(vertex, cells_[k]);
}

AMHEX_HD inline LocalCells::LocalCells(const PlacementView& placement, int32_t vertex,
                                       const CornerPenalty& penalty, FoldWatch watch,
                                       ArrayView<LocalCell> cells)
    : placement_(placement),
      penalty_(penalty),
      position_(placement.vertices[vertex]),
      cells_(cells) {
  for (int64_t k = 0; k < cells.size; ++k) {
    cells_[k].is_near_folding =
        watch == FoldWatch::kSurvey && placement.near_folding[cells_[k].cell] != 0;
    SetCell(vertex, cells_[k]);
  }
}

// Those of cells that are left out, too, in the order in which they come with all cells: their mean
// length is asked for.
AMHEX_HD inline void LocalCells::AddAllEdges(int32_t vertex) {
  const ArrayView<const int32_t> row = placement_.cells_at[vertex];
  for (int64_t k = 0; k < row.size; ++k) {
    VisitEdgesAt(placement_, vertex, row[k], [this](int32_t far_vertex) { EdgeTo(far_vertex); });
  }
}

// The edge's number, a new one if it is seen for the first time.
AMHEX_HD inline int32_t LocalCells::EdgeTo(int32_t far_vertex) {
  for (int32_t e = 0; e < edge_count_; ++e) {
    if (EdgeAt(e).far_vertex == far_vertex) return e;
  }
  MovingEdge& edge = EdgeAt(edge_count_);
  edge.far_vertex = far_vertex;
  edge.far_end = placement_.vertices[far_vertex];
  return edge_count_++;
}

AMHEX_HD inline void LocalCells::SetCell(int32_t vertex, LocalCell& cell) {
  const CellPattern& pattern = placement_.PatternOf(cell.cell);
  const CellCorners& corners = placement_.cells[cell.cell];
  unsigned moving = 0;
  CellPositions positions;
  for (int slot = 0; slot < 8; ++slot) {
    positions[slot] = placement_.vertices[corners[slot]];
    moving |= static_cast<unsigned>(corners[slot] == vertex) << slot;
  }
  const int first_slot = LowestBit(moving);
  cell.moving_slots = static_cast<uint8_t>(moving);
  const unsigned moving_edges = pattern.edges_at[first_slot];
  std::array<Vec3d, 12> direction;      // of the edges that stay
  std::array<int32_t, 12> moving_edge;  // of the others, the number
  std::array<double, 12> moving_sign;   // and -1 where they are stored towards the vertex
  for (int e = 0; e < pattern.edge_count; ++e) {
    const auto& slots = pattern.edge_slots[e];
    if ((moving_edges >> e & 1) == 0) {
      direction[e] = Normalized(positions[slots[1]] - positions[slots[0]]);
      continue;
    }
    const bool leads_away = (moving >> slots[0] & 1) != 0;
    moving_edge[e] = EdgeTo(corners[slots[leads_away ? 1 : 0]]);
    moving_sign[e] = leads_away ? 1 : -1;
  }
  cell.fixed_minimum = 1;
  cell.fixed_deficits = 0;
  cell.far_corner_count = 0;
  cell.own_sign = 0;
  const unsigned moved_corners = pattern.corners_at[first_slot];
  for (int i = 0; i < pattern.corner_count; ++i) {
    const CellPattern::Corner& corner = pattern.corner[i];
    const int a = corner.edge[0], b = corner.edge[1], c = corner.edge[2];
    if ((moved_corners >> i & 1) == 0) {
      const double jacobian = corner.sign * Determinant(direction[a], direction[b], direction[c]);
      cell.fixed_minimum = jacobian < cell.fixed_minimum ? jacobian : cell.fixed_minimum;
      cell.fixed_deficits += DeficitPower(jacobian);
    } else if ((moving >> corner.slot & 1) != 0) {
      cell.own_sign = corner.sign * moving_sign[a] * moving_sign[b] * moving_sign[c];
      cell.own_edge = {moving_edge[a], moving_edge[b], moving_edge[c]};
    } else {
      // One of its three edges moves.
      const bool first = (moving_edges >> a & 1) != 0, second = (moving_edges >> b & 1) != 0;
      const int e = first ? a : (second ? b : c);
      const Vec3d& next = direction[first ? b : (second ? c : a)];
      const Vec3d& after = direction[first ? c : (second ? a : b)];
      cell.far_edge[cell.far_corner_count] = moving_edge[e];
      cell.far_normal[cell.far_corner_count] = Cross(next, after) * (corner.sign * moving_sign[e]);
      ++cell.far_corner_count;
    }
  }
}

AMHEX_HD inline void LocalCells::MoveTo(const Vec3d& position) { position_ = position; }

AMHEX_HD inline void LocalCells::RenewEdges() {
  for (int32_t e = 0; e < edge_count_; ++e) {
    MovingEdge& edge = EdgeAt(e);
    const Vec3d along = edge.far_end - position_;
    const double length = Norm(along);
    edge.inverse_length = length > 0 ? 1 / length : 0.0;
    edge.direction = along * edge.inverse_length;
  }
}

template <class Add>
AMHEX_HD double LocalCells::VisitScore(int64_t k, const Add& add) const {
  const bool of_minima = penalty_.kind == EnergyKind::kMinima;
  const LocalCell& cell = cells_[k];
  double minimum = cell.fixed_minimum;
  double deficits = cell.fixed_deficits;
  for (int i = 0; i < CornerCount(cell); ++i) {
    const double jacobian = JacobianOf(cell, i);
    // Written so that not-a-number lowers the minimum too.
    if (!(jacobian >= minimum)) minimum = std::isnan(jacobian) ? -1 : jacobian;
    if (of_minima) {
      deficits += DeficitPower(jacobian);
    } else {
      add(CornerEnergy(jacobian, penalty_));
    }
  }
  if (of_minima) add(RootedTimes(deficits, penalty_.sharpness));
  if (cell.is_near_folding) add(FoldEnergy(MarginAt(cell, position_)));
  return minimum;
}

AMHEX_HD inline void LocalCells::AddScore(int64_t k, LocalScore& score) const {
  const double minimum = VisitScore(k, [&score](double energy) { score.energy += energy; });
  score.minimum = minimum < score.minimum ? minimum : score.minimum;
}

AMHEX_HD inline LocalScore LocalCells::Score() {
  RenewEdges();
  LocalScore score;
  for (int64_t k = 0; k < cells_.size; ++k) AddScore(k, score);
  return score;
}

AMHEX_HD inline CellPositions LocalCells::PositionsOf(const LocalCell& cell,
                                                      const Vec3d& position) const {
  const CellCorners& corners = placement_.cells[cell.cell];
  CellPositions positions;
  for (int slot = 0; slot < 8; ++slot) {
    positions[slot] =
        (cell.moving_slots >> slot & 1) != 0 ? position : placement_.vertices[corners[slot]];
  }
  return positions;
}

AMHEX_HD inline double LocalCells::MarginAt(const LocalCell& cell, const Vec3d& position) const {
  return FoldMargin(placement_.PatternOf(cell.cell), PositionsOf(cell, position));
}

AMHEX_HD inline double LocalCells::WorstFoldMargin() const {
  double worst = 1;
  for (int64_t k = 0; k < cells_.size; ++k) {
    const double margin = MarginAt(cells_[k], position_);
    worst = margin < worst ? margin : worst;
  }
  return worst;
}

AMHEX_HD inline CornerModel<Vec3d> LocalCells::ModelOf(const LocalCell& cell, int corner) const {
  if (corner < cell.far_corner_count) {
    return CornerModel<Vec3d>(cell.far_normal[corner], EdgeAt(cell.far_edge[corner]));
  }
  return CornerModel<Vec3d>(cell.own_sign, EdgeAt(cell.own_edge[0]), EdgeAt(cell.own_edge[1]),
                            EdgeAt(cell.own_edge[2]));
}

// Of f = (sum of the p-th powers of all deficits)^(1/p): with the shares r = deficit / f,
// df = -r^(p-1) ds, and its second derivative is (p-1) / f (r^(p-2) on the diagonal less r^(p-1)
// times r^(p-1)).
AMHEX_HD inline void LocalCells::AddMinimum(const LocalCell& cell, EnergyModel& model) const {
  constexpr double kPerfect = 1e-6;           // a bound that cannot be lowered further
  constexpr double kNegligibleShare = 1e-30;  // of a corner, its p-th power
  const int corner_count = CornerCount(cell);
  double deficits = cell.fixed_deficits;
  for (int i = 0; i < corner_count; ++i) deficits += DeficitPower(JacobianOf(cell, i));
  const double bound = RootedTimes(deficits, penalty_.sharpness);
  if (!(bound > kPerfect)) return;
  const double curve = ((1 << penalty_.sharpness) - 1) / bound;
  EnergyModel own;
  for (int i = 0; i < corner_count; ++i) {
    const double share = (1 - JacobianOf(cell, i)) / bound;
    const double power = SquaredTimes(share, penalty_.sharpness);
    if (!(power > kNegligibleShare)) continue;
    const double slope = power / share;
    ModelOf(cell, i).AddTo(own, -slope, curve * (slope / share));
  }
  for (int a = 0; a < 3; ++a) {
    model.hessian[a] += own.hessian[a] - own.gradient * (curve * own.gradient[a]);
  }
  model.gradient += own.gradient;
}

template <class Folds>
AMHEX_HD void LocalCells::AddFold(const LocalCell& cell, const Folds& folds,
                                  EnergyModel& model) const {
  // Step of the forward differences in mean edge lengths.
  constexpr double kDifferenceStep = 1e-4;
  const double step = kDifferenceStep * folds.MeanEdgeLengthOf(*this);
  const CellPositions positions = PositionsOf(cell, position_);
  FourPlaces four{placement_.PatternOf(cell.cell),
                  positions,
                  cell.moving_slots,
                  {position_, position_, position_, position_}};
  for (int a = 0; a < 3; ++a) four.places[a + 1][a] += step;
  const std::array<double, 4> margins = folds.MarginsOf(four);
  Vec3d gradient;
  for (int a = 0; a < 3; ++a) gradient[a] = (margins[a + 1] - margins[0]) / step;
  const Slopes slopes = FoldSlopes(margins[0]);
  model.gradient += gradient * slopes.first;
  for (int a = 0; a < 3; ++a) model.hessian[a] += gradient * (slopes.second * gradient[a]);
}

// The corners' summands or that of the minimum, then that of folding.
AMHEX_HD inline int LocalCells::ModelSummands(int64_t k) const {
  const LocalCell& cell = cells_[k];
  const int of_corners = penalty_.kind == EnergyKind::kMinima ? 1 : CornerCount(cell);
  return of_corners + (cell.is_near_folding ? 1 : 0);
}

template <class Folds>
AMHEX_HD void LocalCells::AddModelSummand(int64_t k, int summand, const Folds& folds,
                                          EnergyModel& model) const {
  const LocalCell& cell = cells_[k];
  if (cell.is_near_folding && summand + 1 == ModelSummands(k)) {
    AddFold(cell, folds, model);
  } else if (penalty_.kind == EnergyKind::kMinima) {
    AddMinimum(cell, model);
  } else {
    const Slopes slopes = CornerSlopes(JacobianOf(cell, summand), penalty_);
    ModelOf(cell, summand).AddTo(model, slopes.first, slopes.second);
  }
}

template <class Folds>
AMHEX_HD void LocalCells::AddModel(int64_t k, const Folds& folds, EnergyModel& model) const {
  const int count = ModelSummands(k);
  for (int summand = 0; summand < count; ++summand) AddModelSummand(k, summand, folds, model);
}

AMHEX_HD inline EnergyModel LocalCells::Model() const {
  EnergyModel model;
  for (int64_t k = 0; k < cells_.size; ++k) AddModel(k, FoldQuestions(), model);
  return model;
}

AMHEX_HD inline double LocalCells::MeanEdgeLength() const {
  double sum = 0;
  for (int32_t e = 0; e < edge_count_; ++e) sum += Norm(EdgeAt(e).far_end - position_);
  return edge_count_ > 0 ? sum / edge_count_ : 0.0;
}

}  // namespace amhex
