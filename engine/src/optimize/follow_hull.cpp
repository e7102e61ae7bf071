#include "optimize/follow_hull.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "optimize/draw_jointly.h"
#include "optimize/gap_closer.h"
#include "optimize/hull_deviation.h"
#include "optimize/look_ahead.h"
#include "optimize/placement.h"
#include "optimize/placement_copy.h"
#include "optimize/raise_jointly.h"
#include "optimize/raise_quality.h"
#include "optimize/regain_quality.h"
#include "optimize/take_back_defects.h"

namespace amhex {
namespace {

// Good cells give way down to the minimum, within these bounds, as when the average is raised
// (place_vertices).
constexpr double kLeastFloor = 0.31;
constexpr double kMostFollowingFloor = 0.5;
// Moving vertices costs cells around; sweeps regain what they can. Single ones twice, because the
// sweeps move the boundary too. Before and after, places are drawn jointly: before, because that
// costs the cells less than what single vertices do.
constexpr int kPasses = 2;
// Of noise the hull keeps a little everywhere: a second pass took .7 s of five and left distances
// and averages where they were.
constexpr int kPassesWherePointsScatter = 1;
// Where only some places are followed, gaps this near to one of them are theirs.
constexpr double kReachOfPlace = 3.0;
// Gaps this near to one another may well see each other closed, edge lengths.
constexpr double kSeenAround = 5.0;
// What sweeps move by less leaves answers as they were, edge lengths.
constexpr double kStirred = 0.01;
// What raising jointly has gained is spent on the way to the hull, and gained once more.
double FloorFor(double minimum) {
  constexpr double kSlack = 0.02;  // levels overshoot what is wanted
  if (minimum < kJointlyWanted + kSlack) return kLeastFloor;
  return std::min(minimum, kMostFollowingFloor);
}

// The placement once more, to find out on what would happen to it.
class Rehearsal {
 public:
  Rehearsal(const Placement& placement, const HullSampling& sampling, const DeviationLimits& limits,
            double floor, const GapCloser& closer)
      : copy_(placement), closer_(copy_.placement, sampling, limits, floor) {
    closer_.TakeAllFrom(closer);
  }

  // Becomes as `closer` is, which is at the end of `records`.
  void CatchUp(const GapCloser& closer, const std::vector<GapRecord>& records) {
    closer_.TakeFrom(closer, own_steps_);
    own_steps_.clear();
    for (; seen_records_ < records.size(); ++seen_records_) {
      closer_.TakeFrom(closer, records[seen_records_].steps);
    }
  }
  // What closing the gap would do.
  GapRecord Close(const Gap& gap) {
    GapRecord record = std::move(closer_.Close(gap));
    own_steps_ = record.steps;
    return record;
  }
  void StartAt(size_t records) { seen_records_ = records; }

 private:
  PlacementCopy copy_;
  GapCloser closer_;
  size_t seen_records_ = 0;
  std::vector<GapRecord::Step> own_steps_;  // rehearsed since
};

// What closing a gap was found to do, and when (GapCloser::clock).
struct FoundRecord {
  GapRecord record;
  int64_t looked_at = 0;
};

class Follower {
 public:
  Follower(Placement& placement, const HullSampling& sampling, const DeviationLimits& limits,
           Surroundings around)
      : placement_(placement),
        sampling_(sampling),
        limits_(limits),
        around_(std::move(around)),
        floor_(FloorFor(SummarizeQuality(placement.complex).min_scaled_jacobian)),
        closer_(placement, sampling, limits, floor_),
        draw_(placement, sampling, limits, floor_) {}

  absl::Status Run(const RunContext& run) {
    const StopPoll poll(run);
    GapsAround gaps = FindGaps(kWorthLooking * limits_.limit, poll);
    if (gaps.empty()) return absl::OkStatus();
    AMHEX_RETURN_IF_ERROR(Draw(gaps, run));
    const int passes = sampling_.points_scatter() ? kPassesWherePointsScatter : kPasses;
    for (int pass = 0; pass < passes; ++pass) {
      gaps = FindGaps(kWorthLooking * limits_.limit, poll);
      if (gaps.empty()) return absl::OkStatus();
      AMHEX_RETURN_IF_ERROR(CloseGaps(gaps.All(), run));
      AMHEX_RETURN_IF_ERROR(Regain(closer_.moved(), closer_.moved(), run));
    }
    return Draw(FindGaps(limits_.limit, poll), run);
  }

 private:
  struct GapsAround {
    std::vector<Gap> surface, creases;  // each farthest first
    bool empty() const { return surface.empty() && creases.empty(); }
    std::vector<Gap> All() const {
      std::vector<Gap> all = surface;
      all.insert(all.end(), creases.begin(), creases.end());
      return all;
    }
  };
  GapsAround FindGaps(double beyond, const StopPoll& poll) const {
    return {sampling_.GapsBeyond(beyond, poll, FaceDetail::kFew, around_),
            sampling_.CreaseGapsBeyond(limits_.creases, poll, around_)};
  }

  // Those beyond the limits, jointly.
  absl::Status Draw(GapsAround gaps, const RunContext& run) {
    std::erase_if(gaps.surface, [&](const Gap& gap) { return gap.distance <= limits_.limit; });
    if (gaps.empty()) return absl::OkStatus();
    const std::vector<Vec3d> before = placement_.complex.vertices;
    const bool any = draw_.Run(DistinctGaps(gaps.All(), StopPoll(run)), run);
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
    if (!any) return absl::OkStatus();
    NoteStirred(before);
    return Regain(draw_.moved(), BoundaryVertices(placement_), run);
  }

  // By single vertices. One after the other, but each is looked at side by side with others first:
  // what was found then holds as long as nothing that it depends on has moved.
  absl::Status CloseGaps(const std::vector<Gap>& gaps, const RunContext& run) {
    const std::vector<Gap> distinct = DistinctGaps(gaps, StopPoll(run));
    std::vector<GapRecord> done;
    oneapi::tbb::enumerable_thread_specific<std::unique_ptr<Rehearsal>> rehearsals;
    const auto look = [&](size_t i) {
      std::unique_ptr<Rehearsal>& own = rehearsals.local();
      if (own == nullptr) {
        own = std::make_unique<Rehearsal>(placement_, sampling_, limits_, floor_, closer_);
        own->StartAt(done.size());
      }
      own->CatchUp(closer_, done);
      return [rehearsal = own.get(), gap = &distinct[i], looked_at = closer_.clock()] {
        return FoundRecord{rehearsal->Close(*gap), looked_at};
      };
    };
    const auto holds = [&](size_t, const FoundRecord& found) {
      return !closer_.HasChanged(found.record.seen, found.looked_at);
    };
    const auto take = [&](size_t i, std::optional<FoundRecord> found) {
      if (found.has_value()) {
        closer_.Repeat(found->record);
        done.push_back(std::move(found->record));
      } else {
        closer_.Close(distinct[i]);
      }
      return true;
    };
    const auto are_near = [&](size_t i, size_t j) {
      return Norm(distinct[i].sample - distinct[j].sample) < kSeenAround;
    };
    TakeLookingAhead<FoundRecord>(distinct.size(), run, are_near, look, holds, take);
    return run.CheckStop();
  }

  // What `stays` marks does.
  absl::Status Regain(const std::vector<uint8_t>& moved, const std::vector<uint8_t>& stays,
                      const RunContext& run) {
    const std::vector<Vec3d> before = placement_.complex.vertices;
    AMHEX_RETURN_IF_ERROR(RegainQuality(placement_, moved, stays, floor_, run));
    NoteStirred(before);
    return absl::OkStatus();
  }

  void NoteStirred(const std::vector<Vec3d>& before) {
    for (size_t v = 0; v < before.size(); ++v) {
      if (Norm(placement_.complex.vertices[v] - before[v]) > kStirred) {
        closer_.NoteChange(static_cast<int32_t>(v));
      }
    }
  }

  Placement& placement_;
  const HullSampling& sampling_;
  const DeviationLimits& limits_;
  const Surroundings around_;
  const double floor_;
  GapCloser closer_;
  JointDraw draw_;
};

absl::StatusOr<CellComplex> Follow(CellComplex complex, const Hull& hull,
                                   const HullFeatures& features, Surroundings around,
                                   const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (complex.cells.empty()) return complex;
  const StopPoll poll(run);
  Placement placement = PreparePlacement(complex, features, poll);
  const HullSampling sampling(hull, placement, poll);
  const DeviationLimits limits = LimitsFor(hull);
  const std::vector<Vec3d> before = complex.vertices;
  Follower follower(placement, sampling, limits, std::move(around));
  AMHEX_RETURN_IF_ERROR(follower.Run(run));
  TakeBackDefects(hull, before, poll, &complex);
  return complex;
}

}  // namespace

absl::StatusOr<CellComplex> FollowHull(CellComplex complex, const Hull& hull,
                                       const HullFeatures& features, const RunContext& run) {
  return Follow(std::move(complex), hull, features, {}, run);
}

absl::StatusOr<CellComplex> FollowHullAround(const std::vector<Vec3d>& places, CellComplex complex,
                                             const Hull& hull, const HullFeatures& features,
                                             const RunContext& run) {
  return Follow(std::move(complex), hull, features, {places, kReachOfPlace}, run);
}

}  // namespace amhex
