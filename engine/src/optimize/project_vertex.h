// How far one vertex is drawn to where its constraint wants it; usable where bodies run.
#pragma once

#include <cstdint>

#include "optimize/constrain.h"
#include "optimize/move_judge.h"

namespace amhex {

// Whether the vertex has anything to be drawn to.
AMHEX_HD inline bool IsOnHull(const PlacementView& placement, int32_t v) {
  const Constraint kind = placement.constraints[v].kind;
  return kind != Constraint::kFree && kind != Constraint::kFixed;
}

// Moves a hull vertex towards its constraint's nearest point, by the largest of some shares of the
// way that the judge permits. True if it moved. `room` as for LocalCells, Cells as for MoveJudge.
template <class Cells>
AMHEX_HD inline bool ProjectVertex(const PlacementView& placement, int32_t v, double quality_floor,
                                   LocalCell* room) {
  // Offsets below this many edge lengths are on the hull but for rounding.
  constexpr double kOnHull = 1e-9;
  // Shares of the way to the hull that are tried, in this order.
  constexpr double kFractions[] = {1.0, 0.7, 0.4, 0.15};
  // A move may cost a neighbourhood this share of its worst quality at once, even below the round's
  // floor, but never lead below kLowestFloor; the sweeps between the rounds regain it.
  constexpr double kAllowedShare = 0.75;
  constexpr double kLowestFloor = 0.25;
  const Vec3d start = placement.vertices[v];
  const Vec3d target = FindFoot(placement, v).point;
  if (Norm(target - start) < kOnHull) return false;
  MoveJudge<Cells> judge(placement, v, CornerPenalty{}, FoldWatch::kNone, room);
  const double floor =
      Smaller(quality_floor, Larger(kLowestFloor, kAllowedShare * judge.score().minimum));
  for (const double fraction : kFractions) {
    const Vec3d place = fraction == 1.0 ? target : start + (target - start) * fraction;
    if (judge.Permits(judge.Try(place), floor)) {
      placement.vertices[v] = place;
      return true;
    }
  }
  return false;
}

}  // namespace amhex
