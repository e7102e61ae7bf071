#include "optimize/split_at_gaps.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "closure/boundary_defects.h"
#include "closure/working_mesh.h"
#include "optimize/follow_hull.h"
#include "optimize/gap_place.h"
#include "optimize/hull_deviation.h"
#include "optimize/placement.h"

namespace amhex {
namespace {

constexpr size_t kMostPlaces = 8;
// Of what is left at last, which nothing else will mend. Once so many of these resist, the mesh
// will not come near enough everywhere.
constexpr size_t kMostPlacesAtLast = 24;
constexpr size_t kMostResistingAtLast = 3;
// At first, where there are more, only those that are farther away than so many limits are seen to.
// At 2 a cloud of 5,353 cells took a second for tries in vain.
constexpr double kFarShare = 2.5;
// Gaps this near to one another are one place, edge lengths.
constexpr double kSamePlace = 1.0;
// What is lost is seen to last, and up to here.
constexpr double kOutOfReach = 2.0;
constexpr size_t kTriesPerPlace = 3;

bool AreSame(const Gap& a, const Gap& b) { return Norm(a.sample - b.sample) < kSamePlace; }
bool IsNear(const Gap& gap) { return gap.distance <= kLostDistance; }
size_t CountNear(const std::vector<Gap>& places) {
  return static_cast<size_t>(std::count_if(places.begin(), places.end(), IsNear));
}

class GapSplitter {
 public:
  GapSplitter(const CellComplex& complex, const Hull& hull, const HullFeatures& features,
              const MeshingParams& params, SplitTurn turn, const RunContext& run)
      : complex_(complex),
        turn_(turn),
        with_{{hull, features, params, run},
              LimitsFor(hull),
              turn == SplitTurn::kLast ? FaceDetail::kClosely : FaceDetail::kFew},
        most_places_(IsLast() ? kMostPlacesAtLast : kMostPlaces) {}

  // Nothing where it has come to nothing.
  absl::StatusOr<std::optional<CellComplex>> Run() {
    gaps_ = FindGaps();
    std::vector<Gap> places = Places();
    if (CountNear(places) > most_places_) {
      if (IsLast()) return std::nullopt;
      beyond_ = kFarShare * with_.limits.limit;
      std::erase_if(gaps_, [&](const Gap& gap) { return gap.distance <= beyond_; });
      places = Places();
    }
    if (places.empty() || CountNear(places) > most_places_) return std::nullopt;
    whole_.emplace(complex_, StopPoll(with_.run));
    std::vector<Gap> tried;
    std::vector<Vec3d> split;
    size_t resisting = 0;
    while (CountNear(places) + tried.size() <= most_places_) {
      const auto next = std::find_if(places.begin(), places.end(), [&](const Gap& place) {
        return std::none_of(tried.begin(), tried.end(),
                            [&](const Gap& other) { return AreSame(place, other); });
      });
      if (next == places.end()) break;
      tried.push_back(*next);
      AMHEX_ASSIGN_OR_RETURN(const bool is_split, SplitAt(*next));
      if (is_split) {
        split.push_back(tried.back().sample);
        places = Places();
      } else if (IsLast() && ++resisting == kMostResistingAtLast) {
        return std::nullopt;
      }
    }
    if (split.empty()) return std::nullopt;
    // Regains what the cells around have lost. Elsewhere the hull has been followed before.
    return FollowHullAround(split, std::move(complex_), with_.hull, with_.features, with_.run);
  }

 private:
  bool IsLast() const { return turn_ == SplitTurn::kLast; }

  std::vector<Gap> FindGaps() {
    const StopPoll poll(with_.run);
    const Placement placement = PreparePlacement(complex_, with_.features, poll);
    return HullSampling(with_.hull, placement, poll).GapsBeyond(beyond_, poll, with_.detail);
  }

  // What is beyond the limit, farthest first, and each place once; of those near one more than may
  // be tried if there are so many. What is lost comes last. Without what is no part of the hull.
  std::vector<Gap> Places() const {
    std::vector<Gap> places;
    for (const Gap& gap : gaps_) {
      if (CountNear(places) > most_places_) break;
      if (gap.distance > kOutOfReach || !IsOfHull(gap, with_)) continue;
      const bool is_known = std::any_of(places.begin(), places.end(),
                                        [&](const Gap& place) { return AreSame(place, gap); });
      if (!is_known) places.push_back(gap);
    }
    std::stable_partition(places.begin(), places.end(), IsNear);
    return places;
  }

  // Whether it is mended.
  absl::StatusOr<bool> SplitAt(const Gap& gap) {
    AMHEX_RETURN_IF_ERROR(with_.run.CheckStop());
    const GapPlace place(*whole_, gap, with_);
    std::vector<GapPlace::Candidate> candidates = place.Candidates();
    AMHEX_RETURN_IF_ERROR(with_.run.CheckStop());
    if (candidates.size() > kTriesPerPlace) candidates.resize(kTriesPerPlace);
    for (GapPlace::Candidate& candidate : candidates) {
      const std::optional<CellComplex> drawn = place.Drawn(std::move(candidate));
      AMHEX_RETURN_IF_ERROR(with_.run.CheckStop());
      if (drawn.has_value() && PutIn(place, *drawn)) return true;
    }
    return false;
  }

  // False, and nothing is changed, where the boundary would touch or cross itself.
  bool PutIn(const GapPlace& place, const CellComplex& drawn) {
    const StopPoll poll(with_.run);
    std::optional<WorkingMesh> changed = place.InWhole(*whole_, drawn);
    if (!changed.has_value()) return false;
    CellComplex complex = changed->ToComplex(poll);
    const BoundaryDefects defects =
        FindBoundaryDefectsNear(ChangedIn(complex, place), complex, with_.hull, poll);
    if (!defects.vertices.empty()) return false;
    complex_ = std::move(complex);
    whole_ = *std::move(changed);
    Renew(place, drawn);
    return true;
  }

  // The gaps that the place decides about.
  void Renew(const GapPlace& place, const CellComplex& drawn) {
    std::erase_if(gaps_, [&](const Gap& gap) { return place.Covers(gap.sample); });
    const auto old_end = static_cast<int64_t>(gaps_.size());
    const std::vector<Gap> found = place.GapsIn(drawn, beyond_);
    gaps_.insert(gaps_.end(), found.begin(), found.end());
    std::inplace_merge(gaps_.begin(), gaps_.begin() + old_end, gaps_.end(),
                       [](const Gap& a, const Gap& b) { return a.distance > b.distance; });
  }

  // Vertices that complex_ does not have there, and those around the place, where cells may have
  // gone.
  std::vector<int32_t> ChangedIn(const CellComplex& split, const GapPlace& place) const {
    std::vector<int32_t> vertices;
    for (size_t v = 0; v < split.vertices.size(); ++v) {
      const bool is_new =
          v >= complex_.vertices.size() || split.vertices[v] != complex_.vertices[v];
      if (is_new || place.IsNear(split.vertices[v])) vertices.push_back(static_cast<int32_t>(v));
    }
    return vertices;
  }

  CellComplex complex_;
  std::optional<WorkingMesh> whole_;  // complex_, once there is something to be done
  const SplitTurn turn_;
  const GapsWith with_;
  const size_t most_places_;
  double beyond_ = with_.limits.limit;  // of the gaps that are seen to
  std::vector<Gap> gaps_;               // farthest first
};

}  // namespace

absl::StatusOr<CellComplex> SplitAtGaps(const CellComplex& complex, const Hull& hull,
                                        const HullFeatures& features, const MeshingParams& params,
                                        SplitTurn turn, const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (complex.cells.empty()) return complex;
  AMHEX_ASSIGN_OR_RETURN(std::optional<CellComplex> split,
                         GapSplitter(complex, hull, features, params, turn, run).Run());
  return split.has_value() ? *std::move(split) : complex;
}

}  // namespace amhex
