#include "place_candidates.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/status_macros.h"
#include "optimize/follow_hull.h"
#include "optimize/raise_average.h"
#include "optimize/raise_quality.h"
#include "optimize/report_cells.h"
#include "stage.h"

namespace amhex {
namespace {

// Two or three other cells come of an open face. Where only one trial will be placed, their open
// faces tell enough: of 24 models at 5,000 to 18,000 cells closing both put the second one first
// three times, by less than a twentieth of its loss.
constexpr LittleWork kLittleWork{1, 300, 600};
// Of solids of so few cells more are worth it: what one of their lattices leaves out is a large
// part of them, and that is told by the placed ones alone.
constexpr double kFewCells = 4e3;
constexpr LittleWork kLittleWorkOfFew{2, 600, 1000};

// Less loss than this ends the search among the placed ones.
constexpr double kGoodLoss = 0.02;
// Where a placed mesh has no fault, a closed one of so many times as many other cells is not worth
// placing: its average would have to be better for all that.
constexpr double kManyMoreOthers = 1.5;

// Raises its average to the end and draws it to the hull, which mends distances.
absl::Status Follow(const Improvement& with, RunContext& run, PlacedCandidate& candidate,
                    CostOfFollowing& cost) {
  const PlacedLoss before = candidate.loss;
  AMHEX_ASSIGN_OR_RETURN(candidate.complex, RaiseAverage(std::move(candidate.complex),
                                                         with.features, run, with.device));
  AMHEX_ASSIGN_OR_RETURN(candidate.complex,
                         FollowHull(std::move(candidate.complex), with.hull, with.features, run));
  candidate.is_followed = true;
  candidate.loss = LossOf(candidate.complex, with, kMendableMinimum, StopPoll(run));
  cost.Learn(before, candidate.loss);
  return absl::OkStatus();
}

// How far from the hull one is says little before it has been drawn there, which takes long: done
// where it is likely to be the best then.
absl::Status FollowPromising(const Improvement& with, RunContext& run,
                             std::vector<PlacedCandidate>& placed, CostOfFollowing& cost) {
  for (;;) {
    auto best = std::min_element(placed.begin(), placed.end(),
                                 [&](const PlacedCandidate& a, const PlacedCandidate& b) {
                                   return LikelyTotal(a, cost) < LikelyTotal(b, cost);
                                 });
    if (best->is_followed || best->loss.distance == 0) return absl::OkStatus();
    AMHEX_RETURN_IF_ERROR(Follow(with, run, *best, cost));
  }
}

}  // namespace

const LittleWork& LittleWorkOf(const Hull& hull) {
  return hull.volume <= kFewCells ? kLittleWorkOfFew : kLittleWork;
}

int64_t CountOthers(const CellComplex& complex) {
  const CellCounts counts = CountCells(complex);
  return std::accumulate(counts.begin(), counts.end(), int64_t{0}) -
         counts[static_cast<size_t>(PrimitiveType::kHexahedron)];
}

double LikelyTotal(const PlacedCandidate& candidate, const CostOfFollowing& cost) {
  return candidate.is_followed ? candidate.loss.total() : cost.LikelyTotal(candidate.loss);
}

absl::StatusOr<PlacedCandidates> PlaceCandidates(std::vector<ClosedTrial>& closed,
                                                 const Improvement& with, RunContext& run) {
  std::vector<PlacedCandidate> placed;
  CostOfFollowing cost;
  int64_t others = closed.empty() ? 0 : CountOthers(closed.front().complex);
  bool reach_hull = true;  // those that were drawn there
  for (size_t i = 0; i < closed.size(); ++i) {
    SetPart(i, closed.size(), run);
    const int64_t closed_others = CountOthers(closed[i].complex);
    AMHEX_ASSIGN_OR_RETURN(ImprovedMesh improved,
                           ImproveMesh(std::move(closed[i].complex), with, run));
    placed.push_back({.assembly = closed[i].assembly,
                      .complex = std::move(improved.complex),
                      .closed_others = closed_others,
                      .is_defective = improved.is_defective});
    const int64_t own_others = CountOthers(placed.back().complex);
    const int64_t next_others =
        i + 1 < closed.size() ? CountOthers(closed[i + 1].complex) : int64_t{0};
    others += next_others;
    // Refilling takes longer than placing another one where it may well be in vain.
    const bool is_mendable =
        SummarizeQuality(placed.back().complex, StopPoll(run)).minimum >= kMendableMinimum;
    const bool is_last = i + 1 == closed.size() ||
                         (others > LittleWorkOf(with.hull).others && (i > 0 || is_mendable));
    if (is_last && i == 0) break;  // nothing to choose from
    PlacedCandidate& newest = placed.back();
    newest.loss = LossOf(newest.complex, with, kMendableMinimum, StopPoll(run));
    if (is_last) break;
    // Where a mesh without faults would end the search, and none stayed far from the hull yet: the
    // next ones mostly do so too.
    const bool is_enough =
        static_cast<double>(next_others) > kManyMoreOthers * static_cast<double>(own_others);
    if (reach_hull && newest.loss.distance > 0 && newest.loss.minimum == 0 &&
        (is_enough || newest.loss.cells < kGoodLoss)) {
      AMHEX_RETURN_IF_ERROR(Follow(with, run, newest, cost));
      reach_hull = newest.loss.distance == 0;
    }
    if (newest.loss.total() < kGoodLoss || (newest.loss.faults() == 0 && is_enough)) break;
  }
  if (placed.size() > 1) AMHEX_RETURN_IF_ERROR(FollowPromising(with, run, placed, cost));
  std::stable_sort(placed.begin(), placed.end(),
                   [&](const PlacedCandidate& a, const PlacedCandidate& b) {
                     return LikelyTotal(a, cost) < LikelyTotal(b, cost);
                   });
  return PlacedCandidates{std::move(placed), cost};
}

}  // namespace amhex
