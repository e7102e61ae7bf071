// What drawing one place of the boundary to the hull comes to: its vertices move together by least
// squares.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/run_context.h"
#include "optimize/hull_deviation.h"
#include "optimize/joint_gaps.h"
#include "optimize/joint_place.h"
#include "optimize/placement.h"

namespace amhex {

struct DrawnPlace {
  enum class Outcome : uint8_t { kNotTried, kStayed, kMoved };
  Outcome outcome = Outcome::kNotTried;
  double lacked = -1;           // before; < 0: there was nothing to ask
  std::vector<int32_t> seen;    // vertices whose places have decided
  std::vector<int32_t> moving;  // those that move, if they do
  std::vector<Vec3d> places;    // [moving]
};

// One object for one place after the other. What it was made with must outlive it.
class PlaceDraw {
 public:
  // No cell that is better may fall below `floor`. Cells, constraints and faces of the placement
  // must be those of the sampling's.
  PlaceDraw(Placement& placement, const HullSampling& sampling, const DeviationLimits& limits,
            double floor, FaceDetail detail = FaceDetail::kFew);

  // The place around a cell. All vertices are where they were afterwards. Nothing is tried where
  // about as much is lacking as `known_lack`, when it stayed before; < 0: it was not tried.
  DrawnPlace Find(int32_t cell, double known_lack, const RunContext& run);

 private:
  DrawnPlace Try(double known_lack, const RunContext& run);

  const DeviationLimits& limits_;
  const double floor_;
  JointPlace place_;
  JointGaps around_;
};

}  // namespace amhex
