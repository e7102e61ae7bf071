// LocalCells with the same bits, hexahedra four at a time. On the host only.
#pragma once

#include <cstdint>

#include "absl/container/inlined_vector.h"
#include "optimize/hexahedra_in_lanes.h"
#include "optimize/local_cells.h"

namespace amhex {

class LaneCells {
 public:
  // `room` as for LocalCells.
  LaneCells(const PlacementView& placement, int32_t vertex, const CornerPenalty& penalty,
            FoldWatch watch, LocalCell* room);

  void MoveTo(const Vec3d& position) { others_.MoveTo(position); }
  const Vec3d& position() const { return others_.position(); }
  LocalScore Score();
  double WorstFoldMargin();
  EnergyModel Model();
  // As LocalCells::HoldForAll.
  template <class Condition>
  bool HoldForAll(int64_t count, int64_t first, const Condition& holds) const {
    return others_.HoldForAll(count, first, holds);
  }

 private:
  static constexpr int8_t kInNoLane = -1;
  // Decides which cells are in lanes; those that are not.
  absl::InlinedVector<int32_t, 12> Distribute(const PlacementView& placement, int32_t vertex,
                                              const CornerPenalty& penalty, FoldWatch watch);
  HexahedraInLanes& GroupOf(int8_t lane) {
    return groups_[static_cast<size_t>(lane / HexahedraInLanes::kWidth)];
  }

  absl::InlinedVector<HexahedraInLanes, 2> groups_;
  absl::InlinedVector<int8_t, 24> lane_of_;  // [cell at the vertex] of all groups
  LocalCells others_;
};

}  // namespace amhex
