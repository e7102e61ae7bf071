#include "optimize/lane_cells.h"

#include <algorithm>

namespace amhex {
namespace {

// Fewer hexahedra take as long one by one.
constexpr int kLeastInLanes = 3;

}  // namespace

LaneCells::LaneCells(const PlacementView& placement, int32_t vertex, const CornerPenalty& penalty,
                     FoldWatch watch, LocalCell* room)
    : lanes_(penalty), others_([&] {
        const absl::InlinedVector<int32_t, 12> others = Distribute(placement, vertex, watch);
        return LocalCells(placement, vertex, penalty, watch, room,
                          {others.data(), static_cast<int64_t>(others.size())});
      }()) {
  if (has_lanes_) lanes_.Settle();
}

absl::InlinedVector<int32_t, 12> LaneCells::Distribute(const PlacementView& placement,
                                                       int32_t vertex, FoldWatch watch) {
  const ArrayView<const int32_t> cells = placement.cells_at[vertex];
  lane_of_.assign(static_cast<size_t>(cells.size), kInNoLane);
  // Cells near folding are watched one by one.
  const auto may_be_in_lane = [&](int32_t cell) {
    return placement.PatternOf(cell).type == PrimitiveType::kHexahedron &&
           (watch == FoldWatch::kNone || placement.near_folding[cell] == 0);
  };
  has_lanes_ = std::count_if(cells.data, cells.data + cells.size, may_be_in_lane) >= kLeastInLanes;
  absl::InlinedVector<int32_t, 12> others;
  int8_t lane = 0;
  for (int64_t k = 0; k < cells.size; ++k) {
    if (has_lanes_ && may_be_in_lane(cells[k]) && !lanes_.IsFull()) {
      lanes_.Add(placement, vertex, cells[k]);
      lane_of_[static_cast<size_t>(k)] = lane++;
    } else {
      others.push_back(cells[k]);
    }
  }
  return others;
}

// Sums are in the order of the cells at the vertex.
LocalScore LaneCells::Score() {
  if (!has_lanes_) return others_.Score();
  others_.RenewEdges();
  lanes_.Score(position());
  LocalScore score;
  int64_t other = 0;
  for (const int8_t lane : lane_of_) {
    if (lane == kInNoLane) {
      others_.AddScore(other++, score);
    } else {
      score.minimum = Smaller(lanes_.MinimumOf(lane), score.minimum);
      lanes_.AddEnergy(lane, score.energy);
    }
  }
  return score;
}

double LaneCells::WorstFoldMargin() {
  const double others = others_.WorstFoldMargin();
  if (!has_lanes_) return others;
  return Smaller(lanes_.WorstFoldMargin(position()), others);
}

EnergyModel LaneCells::Model() {
  if (!has_lanes_) return others_.Model();
  lanes_.Model();
  EnergyModel model;
  int64_t other = 0;
  for (const int8_t lane : lane_of_) {
    if (lane == kInNoLane) {
      others_.AddModel(other++, model);
    } else {
      lanes_.AddModel(lane, model);
    }
  }
  return model;
}

}  // namespace amhex
