#include "optimize/draw_rest.h"

#include <vector>

#include "base/status_macros.h"
#include "optimize/draw_jointly.h"
#include "optimize/hull_deviation.h"
#include "optimize/placement.h"
#include "optimize/take_back_defects.h"

namespace amhex {
namespace {

// Where there are more, drawing was in vain before.
constexpr size_t kMostPlaces = 48;
// What mends one place may cost the next.
constexpr int kRounds = 3;
// Of the limits: distances are measured at other places than these, too.
constexpr double kMargin = 0.97;
// As follow_hull.
constexpr double kLeastQuality = 0.31;

}  // namespace

absl::StatusOr<CellComplex> DrawRest(CellComplex complex, const Hull& hull,
                                     const HullFeatures& features, const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (complex.cells.empty()) return complex;
  const StopPoll poll(run);
  Placement placement = PreparePlacement(complex, features, poll);
  const HullSampling sampling(hull, placement, poll);
  DeviationLimits limits = LimitsFor(hull);
  limits.limit *= kMargin;
  const std::vector<Vec3d> before = complex.vertices;
  JointDraw draw(placement, sampling, limits, kLeastQuality, FaceDetail::kClosely);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Gap> places =
        DistinctGaps(sampling.GapsBeyond(limits.limit, poll, FaceDetail::kClosely), poll);
    if (places.empty() || places.size() > kMostPlaces || !draw.Run(places, run)) break;
  }
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  TakeBackDefects(hull, before, poll, &complex);
  return complex;
}

}  // namespace amhex
