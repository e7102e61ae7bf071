#include "optimize/split_at_gaps.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "closure/boundary_defects.h"
#include "closure/working_mesh.h"
#include "input/hull_queries.h"
#include "optimize/draw_jointly.h"
#include "optimize/follow_hull.h"
#include "optimize/hull_deviation.h"
#include "optimize/place_vertices.h"
#include "optimize/placement.h"
#include "optimize/seat_excerpt.h"

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
// How far around a gap distances are measured: the faces at its vertex reach no farther.
constexpr double kSeenAround = 2.0;
// What is lost is seen to last, and up to here.
constexpr double kOutOfReach = 2.0;
// Of what a distance is beyond the limit, this must go.
constexpr double kWorthwhileShare = 0.5;
constexpr size_t kTriesPerPlace = 3;
// Each try looks at the whole mesh: a second of a core for about so many cells.
constexpr size_t kMostCellsTried = 40'000;

class GapSplitter {
 public:
  GapSplitter(const CellComplex& complex, const Hull& hull, const HullFeatures& features,
              SplitTurn turn, const RunContext& run)
      : complex_(complex),
        hull_(hull),
        features_(features),
        turn_(turn),
        run_(run),
        limits_(LimitsFor(hull)),
        most_places_(IsLast() ? kMostPlacesAtLast : kMostPlaces) {}

  // Nothing where it has come to nothing.
  absl::StatusOr<std::optional<CellComplex>> Run() {
    std::vector<Gap> places = Places();
    if (CountNear(places) > most_places_) {
      if (IsLast()) return std::nullopt;
      beyond_ = kFarShare * limits_.limit;
      places = Places();
    }
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
    return FollowHullAround(split, std::move(complex_), hull_, features_, run_);
  }

 private:
  // A seat's part of the mesh with its vertex, and the largest distance there.
  struct Candidate {
    size_t seat = 0;
    PlacementEffort effort = PlacementEffort::kJoint;
    CellComplex part;
    double distance = 0;
  };

  bool IsLast() const { return turn_ == SplitTurn::kLast; }
  FaceDetail Detail() const { return IsLast() ? FaceDetail::kClosely : FaceDetail::kFew; }
  static bool AreSame(const Gap& a, const Gap& b) { return Norm(a.sample - b.sample) < kSamePlace; }

  // An input point may be on neither.
  bool IsOnHull(const Vec3d& p) const { return hull_.queries->Closest(p).distance < limits_.free; }
  bool IsOnBoundary(const Vec3d& p) const {
    constexpr double kRounding = 1e-6;
    return std::any_of(complex_.hull_faces.begin(), complex_.hull_faces.end(),
                       [&](const CellFace& face) {
                         return DistanceToFace(p, face, complex_.vertices) < kRounding;
                       });
  }

  // What is beyond the limit, farthest first, and each place once; of those near one more than may
  // be tried if there are so many. What is lost comes last. Without what is no part of the hull.
  std::vector<Gap> Places() {
    const StopPoll poll(run_);
    Placement placement = PreparePlacement(complex_, features_, poll);
    const HullSampling sampling(hull_, placement, poll);
    std::vector<Gap> places;
    for (const Gap& gap : sampling.GapsBeyond(beyond_, poll, Detail())) {
      if (CountNear(places) > most_places_) break;
      if (gap.distance > kOutOfReach) continue;
      if (!IsOnHull(gap.sample) && !IsOnBoundary(gap.sample)) continue;
      const bool is_known = std::any_of(places.begin(), places.end(),
                                        [&](const Gap& place) { return AreSame(place, gap); });
      if (!is_known) places.push_back(gap);
    }
    std::stable_partition(places.begin(), places.end(), IsNear);
    samples_ = sampling.points();
    return places;
  }
  static bool IsNear(const Gap& gap) { return gap.distance <= kLostDistance; }
  static size_t CountNear(const std::vector<Gap>& places) {
    return static_cast<size_t>(std::count_if(places.begin(), places.end(), IsNear));
  }

  // Whether it is mended.
  absl::StatusOr<bool> SplitAt(const Gap& gap) {
    AMHEX_RETURN_IF_ERROR(run_.CheckStop());
    const StopPoll poll(run_);
    const bool is_hulls = IsOnHull(gap.sample);
    const Vec3d& on_hull = is_hulls ? gap.sample : gap.nearest;
    const Vec3d& on_mesh = is_hulls ? gap.nearest : gap.sample;
    const WorkingMesh whole(complex_, poll);
    const std::vector<SeatExcerpt> seats = Seats(on_mesh, whole);
    std::vector<Candidate> candidates = Candidates(on_hull, seats);
    AMHEX_RETURN_IF_ERROR(run_.CheckStop());
    const double excess = std::max(0.0, gap.distance - limits_.limit);
    const double wanted = gap.distance - kWorthwhileShare * excess;
    if (candidates.size() > kTriesPerPlace) candidates.resize(kTriesPerPlace);
    for (Candidate& candidate : candidates) {
      cells_tried_ += complex_.cells.size();
      if (cells_tried_ > kMostCellsTried) break;
      std::optional<CellComplex> split = InWhole(whole, seats, std::move(candidate));
      AMHEX_RETURN_IF_ERROR(run_.CheckStop());
      if (!split.has_value()) continue;
      const double distance = DrawAt(on_hull, *split);
      AMHEX_RETURN_IF_ERROR(run_.CheckStop());
      if (distance > wanted) continue;
      if (!FindBoundaryDefectsNear(NewIn(*split), *split, hull_, poll).vertices.empty()) continue;
      complex_ = *std::move(split);
      return true;
    }
    return false;
  }

  std::vector<SeatExcerpt> Seats(const Vec3d& on_mesh, const WorkingMesh& whole) const {
    const CellLists cells_at = whole.CellsAtVertices(StopPoll(run_));
    std::vector<SeatExcerpt> seats;
    for (const Seat& seat : SeatsAt(on_mesh, complex_, whole, cells_at)) {
      seats.emplace_back(whole, cells_at, seat);
    }
    return seats;
  }

  // Nearest to the hull first.
  std::vector<Candidate> Candidates(const Vec3d& on_hull,
                                    const std::vector<SeatExcerpt>& seats) const {
    constexpr std::array kEfforts = {PlacementEffort::kJoint, PlacementEffort::kBearable};
    std::vector<std::optional<Candidate>> found(seats.size() * kEfforts.size());
    oneapi::tbb::parallel_for(size_t{0}, found.size(), [&](size_t i) {
      if (run_.ShouldStop()) return;
      const size_t seat = i / kEfforts.size();
      const PlacementEffort effort = kEfforts[i % kEfforts.size()];
      auto part = seats[seat].WithVertex(on_hull, features_, effort, run_);
      if (!part.has_value()) return;
      const double distance = LargestDistance(*part, on_hull);
      found[i] = {seat, effort, *std::move(part), distance};
    });
    std::vector<Candidate> candidates;
    for (std::optional<Candidate>& candidate : found) {
      if (candidate.has_value()) candidates.push_back(*std::move(candidate));
    }
    std::stable_sort(
        candidates.begin(), candidates.end(),
        [](const Candidate& a, const Candidate& b) { return a.distance < b.distance; });
    return candidates;
  }

  // What only has bearable cells is raised to the end first: that takes three times as long as to
  // find out whether it can have them, and mostly it cannot, or another candidate is nearer.
  std::optional<CellComplex> InWhole(const WorkingMesh& whole,
                                     const std::vector<SeatExcerpt>& seats,
                                     Candidate candidate) const {
    const SeatExcerpt& seat = seats[candidate.seat];
    std::optional<CellComplex> part = std::move(candidate.part);
    if (candidate.effort == PlacementEffort::kBearable) {
      part = seat.Raised(*std::move(part), features_, run_);
    }
    if (!part.has_value()) return std::nullopt;
    return seat.InWhole(whole, *part, StopPoll(run_));
  }

  // Between hull and boundary near a place, either way.
  double LargestDistance(const CellComplex& part, const Vec3d& at) const {
    double largest = 0;
    for (const Vec3d& p : samples_) {
      if (Norm(p - at) > kSeenAround) continue;
      double least = 1e300;
      for (const CellFace& face : part.hull_faces) {
        least = std::min(least, DistanceToFace(p, face, part.vertices));
        if (least <= largest) break;
      }
      largest = std::max(largest, least);
    }
    for (const CellFace& face : part.hull_faces) {
      const Vec3d middle = MiddleOf(face, part.vertices);
      if (Norm(middle - at) > kSeenAround) continue;
      largest = std::max(largest, hull_.queries->Closest(middle).distance);
    }
    return largest;
  }

  // Draws what is beyond the limit there to the hull. Returns the largest distance beyond the limit
  // then, 0 if there is none.
  double DrawAt(const Vec3d& place, CellComplex& complex) const {
    const StopPoll poll(run_);
    Placement placement = PreparePlacement(complex, features_, poll);
    const auto find_gaps = [&](const HullSampling& sampling) {
      return sampling.GapsBeyond(limits_.limit, poll, Detail(), {{place}, kSeenAround});
    };
    const HullSampling sampling(hull_, placement, poll);
    std::vector<Gap> gaps = find_gaps(sampling);
    if (IsLast()) gaps = DistinctGaps(gaps, poll);
    if (gaps.empty()) return 0;
    JointDraw(placement, sampling, limits_, kBearable, Detail()).Run(gaps, run_);
    gaps = find_gaps(HullSampling(hull_, placement, poll));
    return gaps.empty() ? 0 : gaps.front().distance;
  }

  // Vertices that complex_ does not have there.
  std::vector<int32_t> NewIn(const CellComplex& split) const {
    std::vector<int32_t> vertices;
    for (size_t v = 0; v < split.vertices.size(); ++v) {
      if (v < complex_.vertices.size() && split.vertices[v] == complex_.vertices[v]) continue;
      vertices.push_back(static_cast<int32_t>(v));
    }
    return vertices;
  }

  CellComplex complex_;
  const Hull& hull_;
  const HullFeatures& features_;
  const SplitTurn turn_;
  const RunContext& run_;
  const DeviationLimits limits_;
  const size_t most_places_;
  std::vector<Vec3d> samples_;  // of the hull, those far from complex_ among them
  size_t cells_tried_ = 0;
  double beyond_ = limits_.limit;  // of the gaps that are seen to
};

}  // namespace

absl::StatusOr<CellComplex> SplitAtGaps(const CellComplex& complex, const Hull& hull,
                                        const HullFeatures& features, SplitTurn turn,
                                        const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (complex.cells.empty()) return complex;
  AMHEX_ASSIGN_OR_RETURN(std::optional<CellComplex> split,
                         GapSplitter(complex, hull, features, turn, run).Run());
  return split.has_value() ? *std::move(split) : complex;
}

}  // namespace amhex
