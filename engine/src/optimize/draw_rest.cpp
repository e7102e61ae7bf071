#include "optimize/draw_rest.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "optimize/draw_jointly.h"
#include "optimize/hull_deviation.h"
#include "optimize/placement.h"
#include "optimize/raise_quality.h"
#include "optimize/regain_quality.h"
#include "optimize/take_back_defects.h"

namespace amhex {
namespace {

// Where points scatter and there are more places than are drawn in one round, none is: up to 150
// took a quarter of the run of a noisy cloud, whose farthest point went from 0.59 to 0.51 % of the
// diagonal. Nor is any where there are more and a part is lost: they are at that part.
// What mends one place may cost the next.
constexpr int kRounds = 5;
// Of the limits: distances are measured at other places than these, too.
constexpr double kMargin = 0.94;
constexpr double kMarginOfMended = 0.97;
// Of coming near enough (DeviationLimits::worth): nothing else will mend the place.
constexpr double kWorthAtLast = 4;
// No cell that is better falls below this, and at first none below the mesh's minimum, which counts
// up to here.
constexpr double kLeastQuality = 0.31;
constexpr double kMostDrawingFloor = 0.5;

// The gaps beyond a distance, faces looked at closely, farthest first. After the first time it
// looks only around what has moved.
class GapWatch {
 public:
  GapWatch(const Placement& placement, const HullSampling& sampling, double distance)
      : placement_(placement),
        sampling_(sampling),
        distance_(distance),
        on_boundary_(BoundaryVertices(placement)) {}

  const std::vector<Gap>& Look(const StopPoll& poll) {
    const Surroundings around = WhatMoved(poll);
    if (!around.IsEverywhere() && around.places.empty()) return gaps_;
    std::erase_if(gaps_, [&](const Gap& gap) { return around.Contain(gap.sample); });
    const std::vector<Gap> found =
        sampling_.GapsBeyond(distance_, poll, FaceDetail::kClosely, around);
    const auto old_end = static_cast<int64_t>(gaps_.size());
    gaps_.insert(gaps_.end(), found.begin(), found.end());
    std::inplace_merge(gaps_.begin(), gaps_.begin() + old_end, gaps_.end(),
                       [](const Gap& a, const Gap& b) { return a.distance > b.distance; });
    seen_ = placement_.complex.vertices;
    return gaps_;
  }

 private:
  // Around vertices of the boundary that are no longer where they were; everywhere at first.
  Surroundings WhatMoved(const StopPoll& poll) const {
    // One place stands for all that moved so near to it; faces at vertices reach farther, and so
    // do samples that are nearest to them.
    constexpr double kSamePlace = 1.0, kReach = 3.0;
    if (seen_.empty()) return {};
    Surroundings around{{}, kSamePlace + kReach};
    for (size_t v = 0; v < seen_.size(); ++v) {
      poll.At(static_cast<int64_t>(v));
      const Vec3d& p = placement_.complex.vertices[v];
      if (on_boundary_[v] == 0 || p == seen_[v]) continue;
      const bool is_stood_for =
          std::any_of(around.places.begin(), around.places.end(),
                      [&](const Vec3d& place) { return Norm(p - place) < kSamePlace; });
      if (!is_stood_for) around.places.push_back(p);
    }
    return around;
  }

  const Placement& placement_;
  const HullSampling& sampling_;
  const double distance_;
  const std::vector<uint8_t> on_boundary_;  // [vertex]
  std::vector<Gap> gaps_;
  std::vector<Vec3d> seen_;  // [vertex] where it was the last time
};

class RestDraw {
 public:
  RestDraw(Placement& placement, const HullSampling& sampling, const DeviationLimits& limits,
           size_t most_places)
      : placement_(placement),
        sampling_(sampling),
        limits_(limits),
        most_places_(most_places),
        watch_(placement, sampling, limits.limit) {}

  // Returns how many places are too far away then.
  size_t Run(const RunContext& run) {
    const double minimum = MinimumNow(run);
    const double floor = std::clamp(minimum, kLeastQuality, kMostDrawingFloor);
    std::vector<Gap> places = DrawAbove(floor, run);
    if (places.empty() || floor == kLeastQuality) return places.size();
    const size_t left_above = places.size();
    // The minimum is worth giving up for a mesh that is near enough everywhere, not for less.
    const std::vector<Vec3d> before = placement_.complex.vertices;
    places = DrawAbove(kLeastQuality, run);
    const bool is_near_enough =
        places.empty() || places.front().distance <= limits_.limit / kMargin;
    if (is_near_enough || MinimumNow(run) >= floor) return places.size();
    placement_.complex.vertices = before;
    return left_above;
  }

 private:
  double MinimumNow(const RunContext& run) const {
    return SummarizeQuality(placement_.complex, StopPoll(run)).minimum;
  }
  // Beyond the limit, farthest first.
  std::vector<Gap> Places(const RunContext& run) {
    const StopPoll poll(run);
    return DistinctGaps(watch_.Look(poll), poll);
  }

  // Returns the places that are left.
  std::vector<Gap> DrawAbove(double floor, const RunContext& run) {
    std::vector<Gap> places = Places(run);
    if (most_places_ < kMostPlacesDrawn && places.size() > most_places_) return places;
    JointDraw draw(placement_, sampling_, limits_, floor, FaceDetail::kClosely);
    for (int round = 0; round < kRounds; ++round) {
      if (places.size() > kMostPlacesDrawn) {
        if (sampling_.points_scatter() || places.front().distance > kLostDistance) break;
        places.resize(kMostPlacesDrawn);
      }
      if (places.empty() || !draw.Run(places, run)) break;
      places = Places(run);
    }
    return places;
  }

  Placement& placement_;
  const HullSampling& sampling_;
  const DeviationLimits& limits_;
  const size_t most_places_;
  GapWatch watch_;
};

// Around what has moved. The boundary stays as near as it is.
absl::Status RegainInside(const std::vector<Vec3d>& before, Placement& placement,
                          const RunContext& run) {
  std::vector<uint8_t> moved(before.size(), 0);
  for (size_t v = 0; v < before.size(); ++v) {
    if (placement.complex.vertices[v] != before[v]) moved[v] = 1;
  }
  if (std::find(moved.begin(), moved.end(), 1) == moved.end()) return absl::OkStatus();
  const double minimum = SummarizeQuality(placement.complex, StopPoll(run)).minimum;
  return RegainQuality(placement, moved, BoundaryVertices(placement),
                       std::clamp(minimum, kLeastQuality, kMostDrawingFloor), run);
}

}  // namespace

absl::StatusOr<RestDrawn> DrawRest(CellComplex complex, const Hull& hull,
                                   const HullFeatures& features, const RunContext& run,
                                   size_t most_places) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (complex.cells.empty()) return RestDrawn{std::move(complex)};
  const StopPoll poll(run);
  Placement placement = PreparePlacement(complex, features, poll);
  const HullSampling sampling(hull, placement, poll);
  DeviationLimits limits = LimitsFor(hull);
  limits.limit *= kMargin;
  limits.mended *= kMarginOfMended;
  limits.worth = kWorthAtLast;
  const std::vector<Vec3d> before = complex.vertices;
  size_t places_left = RestDraw(placement, sampling, limits, most_places).Run(run);
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  AMHEX_RETURN_IF_ERROR(RegainInside(before, placement, run));
  const std::vector<Vec3d> drawn = complex.vertices;
  TakeBackDefects(hull, before, poll, &complex);
  if (complex.vertices != drawn) places_left = std::max<size_t>(places_left, 1);
  return RestDrawn{std::move(complex), places_left};
}

}  // namespace amhex
