// LocalCells with the same bits, shared by the threads of a team: each has some of the cells around
// the vertex. On a CUDA device only.
#pragma once

#include <array>
#include <cstdint>

#include "exec/team.cuh"
#include "optimize/local_cells.h"

namespace amhex {

class TeamCells {
 public:
  // `room` as for LocalCells.
  __device__ TeamCells(const PlacementView& placement, int32_t vertex, const CornerPenalty& penalty,
                       FoldWatch watch, LocalCell* room)
      : placement_(placement),
        vertex_(vertex),
        row_(placement.cells_at[vertex]),
        own_(placement, vertex, penalty, watch, OwnCells(room)) {}

  __device__ void MoveTo(const Vec3d& position) { own_.MoveTo(position); }
  __device__ const Vec3d& position() const { return own_.position(); }

  __device__ LocalScore Score() {
    own_.RenewEdges();
    LocalScore score;
    double minimum = score.minimum;
    for (int64_t round = 0; round < round_count(); ++round) {
      std::array<double, LocalCells::kMostSummands> summands;
      int count = 0;
      if (round < own_.count()) {
        const double least =
            own_.VisitScore(round, [&](double energy) { summands[count++] = energy; });
        minimum = least < minimum ? least : minimum;
      }
      // In the order of the cells.
      for (int rank = 0; rank < Team::kWidth; ++rank) {
        if (rank == team_.rank()) {
          for (int i = 0; i < count; ++i) score.energy += summands[i];
        }
        score.energy = team_.From(rank, score.energy);
      }
    }
    score.minimum = team_.Least(minimum);
    return score;
  }

  __device__ double WorstFoldMargin() const {
    double worst = 1;
    for (int64_t k = 0; k < own_.count(); ++k) worst = Smaller(own_.FoldMarginOf(k), worst);
    return team_.Least(worst);
  }

  __device__ EnergyModel Model() const {
    EnergyModel model;
    const SharedFolds folds{MeanEdgeLength()};
    for (int64_t round = 0; round < round_count(); ++round) {
      std::array<EnergyModel, LocalCells::kMostSummands> summands;
      const int count = round < own_.count() ? own_.ModelSummands(round) : 0;
      for (int i = 0; i < count; ++i) {
        summands[i] = {};
        own_.AddModelSummand(round, i, folds, summands[i]);
      }
      for (int rank = 0; rank < Team::kWidth; ++rank) {
        if (rank == team_.rank()) {
          for (int i = 0; i < count; ++i) Add(summands[i], model);
        }
        model.gradient = team_.From(rank, model.gradient);
        for (Vec3d& row : model.hessian) row = team_.From(rank, row);
      }
    }
    return model;
  }

  // As LocalCells::HoldForAll, in no order.
  template <class Condition>
  __device__ bool HoldForAll(int64_t count, int64_t /*first*/, const Condition& holds) const {
    bool fails = false;
    for (int64_t i = team_.rank(); i < count && !fails; i += Team::kWidth) fails = !holds(i);
    return !team_.IsAny(fails);
  }

 private:
  struct SharedFolds : FoldQuestions {
    double mean_edge_length;
    __device__ explicit SharedFolds(double length) : mean_edge_length(length) {}
    __device__ double MeanEdgeLengthOf(const LocalCells& /*own*/) const { return mean_edge_length; }
  };

  // Zero is added to no sum that it would change: none is -0.
  __device__ static void Add(const EnergyModel& summand, EnergyModel& model) {
    model.gradient += summand.gradient;
    for (int a = 0; a < 3; ++a) model.hessian[a] += summand.hessian[a];
  }

  __device__ int64_t round_count() const { return (row_.size + Team::kWidth - 1) / Team::kWidth; }

  // Every so many cells one, in a part of the room.
  __device__ ArrayView<LocalCell> OwnCells(LocalCell* room) const {
    const int64_t rank = team_.rank(), all = row_.size / Team::kWidth,
                  rest = row_.size % Team::kWidth;
    const ArrayView<LocalCell> cells{room + rank * all + Smaller(rank, rest),
                                     all + (rank < rest ? 1 : 0)};
    for (int64_t k = 0; k < cells.size; ++k) cells[k].cell = row_[k * Team::kWidth + rank];
    return cells;
  }

  // LocalCells::MeanEdgeLength of all cells; zero where none asks for it.
  __device__ double MeanEdgeLength() const {
    bool is_asked = false;
    for (int64_t k = 0; k < own_.count(); ++k) is_asked |= own_.IsNearFolding(k);
    if (!team_.IsAny(is_asked)) return 0;
    double sum = 0;
    int32_t edge_count = 0;
    for (int64_t round = 0; round < round_count(); ++round) {
      std::array<double, LocalCell::kMostEdges> lengths;
      int count = 0;
      if (round < own_.count()) count = LengthsOfNewEdges(round, lengths);
      for (int rank = 0; rank < Team::kWidth; ++rank) {
        if (rank == team_.rank()) {
          for (int i = 0; i < count; ++i) sum += lengths[i];
        }
        sum = team_.From(rank, sum);
        edge_count += team_.From(rank, count);
      }
    }
    return edge_count > 0 ? sum / edge_count : 0.0;
  }

  // Of those edges of the own cell of this round that no cell before it has.
  __device__ int LengthsOfNewEdges(int64_t round,
                                   std::array<double, LocalCell::kMostEdges>& lengths) const {
    const int64_t own = round * Team::kWidth + team_.rank();
    int count = 0;
    VisitEdgesAt(placement_, vertex_, row_[own], [&](int32_t far_vertex) {
      bool is_new = true;
      for (int64_t k = 0; k < own && is_new; ++k) {
        VisitEdgesAt(placement_, vertex_, row_[k],
                     [&](int32_t other) { is_new = is_new && other != far_vertex; });
      }
      if (is_new) lengths[count++] = Norm(placement_.vertices[far_vertex] - own_.position());
    });
    return count;
  }

  const PlacementView& placement_;
  int32_t vertex_;
  ArrayView<const int32_t> row_;  // cells at the vertex
  Team team_;
  LocalCells own_;
};

}  // namespace amhex
