#include "optimize/lane_cells.h"

#include <algorithm>
#include <array>

#include "optimize/fold_margin_lanes.h"

namespace amhex {
namespace {

constexpr int kWidth = HexahedraInLanes::kWidth;
// So few hexahedra take as long one by one.
constexpr int kFewestInLanes = 2;
constexpr int kMostInLanes = 2 * kWidth;

// How many of `count` hexahedra are in lanes.
int CountInLanes(int64_t count) {
  const auto most = static_cast<int>(std::min<int64_t>(count, kMostInLanes));
  return most % kWidth < kFewestInLanes ? most / kWidth * kWidth : most;
}

// FoldQuestions with all four places at once.
struct FoldQuestionsInLanes : FoldQuestions {
  std::array<double, 4> MarginsOf(const FourPlaces& of) const {
    std::array<double, 4> margins;
    RunWithWidestVectors([&] {
      FourCells corner;
      for (int slot = 0; slot < 8; ++slot) {
        const bool moves = (of.moving_slots >> slot & 1) != 0;
        for (int lane = 0; lane < kWidth; ++lane) {
          corner[slot].Set(lane, moves ? of.places[lane] : of.positions[slot]);
        }
      }
      const HalfLanes found = FoldMarginsOf(of.pattern, corner);
      for (int lane = 0; lane < kWidth; ++lane) margins[lane] = found[lane];
    });
    return margins;
  }
};

}  // namespace

LaneCells::LaneCells(const PlacementView& placement, int32_t vertex, const CornerPenalty& penalty,
                     FoldWatch watch, LocalCell* room)
    : others_([&] {
        const absl::InlinedVector<int32_t, 12> others =
            Distribute(placement, vertex, penalty, watch);
        return LocalCells(placement, vertex, penalty, watch, room,
                          {others.data(), static_cast<int64_t>(others.size())});
      }()) {
  for (HexahedraInLanes& group : groups_) group.Settle();
}

absl::InlinedVector<int32_t, 12> LaneCells::Distribute(const PlacementView& placement,
                                                       int32_t vertex, const CornerPenalty& penalty,
                                                       FoldWatch watch) {
  const ArrayView<const int32_t> cells = placement.cells_at[vertex];
  lane_of_.assign(static_cast<size_t>(cells.size), kInNoLane);
  // Cells near folding are watched one by one.
  const auto may_be_in_lane = [&](int32_t cell) {
    return placement.PatternOf(cell).type == PrimitiveType::kHexahedron &&
           (watch == FoldWatch::kNone || placement.near_folding[cell] == 0);
  };
  const int in_lanes =
      CountInLanes(std::count_if(cells.data, cells.data + cells.size, may_be_in_lane));
  absl::InlinedVector<int32_t, 12> others;
  int8_t lane = 0;
  for (int64_t k = 0; k < cells.size; ++k) {
    if (lane < in_lanes && may_be_in_lane(cells[k])) {
      if (lane % kWidth == 0) groups_.emplace_back(penalty);
      groups_.back().Add(placement, vertex, cells[k]);
      lane_of_[static_cast<size_t>(k)] = lane++;
    } else {
      others.push_back(cells[k]);
    }
  }
  return others;
}

// Sums are in the order of the cells at the vertex.
LocalScore LaneCells::Score() {
  if (groups_.empty()) return others_.Score();
  others_.RenewEdges();
  for (HexahedraInLanes& group : groups_) group.Score(position());
  LocalScore score;
  int64_t other = 0;
  for (const int8_t lane : lane_of_) {
    if (lane == kInNoLane) {
      others_.AddScore(other++, score);
    } else {
      const HexahedraInLanes& group = GroupOf(lane);
      score.minimum = Smaller(group.MinimumOf(lane % kWidth), score.minimum);
      group.AddEnergy(lane % kWidth, score.energy);
    }
  }
  return score;
}

double LaneCells::WorstFoldMargin() {
  double worst = others_.WorstFoldMargin();
  for (const HexahedraInLanes& group : groups_) {
    worst = Smaller(group.WorstFoldMargin(position()), worst);
  }
  return worst;
}

EnergyModel LaneCells::Model() {
  for (HexahedraInLanes& group : groups_) group.Model();
  EnergyModel model;
  int64_t other = 0;
  for (const int8_t lane : lane_of_) {
    if (lane == kInNoLane) {
      others_.AddModel(other++, FoldQuestionsInLanes(), model);
    } else {
      GroupOf(lane).AddModel(lane % kWidth, model);
    }
  }
  return model;
}

}  // namespace amhex
