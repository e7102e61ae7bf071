#include "optimize/split_at_gaps.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "closure/boundary_defects.h"
#include "closure/excerpt.h"
#include "closure/working_mesh.h"
#include "input/hull_queries.h"
#include "input/triangle_math.h"
#include "optimize/cell_quality.h"
#include "optimize/draw_jointly.h"
#include "optimize/follow_hull.h"
#include "optimize/hull_deviation.h"
#include "optimize/place_vertices.h"
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
// How far around a gap distances are measured: the faces at its vertex reach no farther.
constexpr double kSeenAround = 2.0;
// What is lost is seen to last, and up to here.
constexpr double kOutOfReach = 2.0;
// As follow_hull.
constexpr double kLeastQuality = 0.31;
// Of what a distance is beyond the limit, this must go.
constexpr double kWorthwhileShare = 0.5;
// Rings of cells around the new ones: vertices of the first may move, the others are there to be
// seen by corners of the hull (place_refill.cpp).
constexpr int kMovingRings = 2;
constexpr int kSeenRings = 2;
constexpr size_t kTriesPerPlace = 3;
// Each try looks at the whole mesh: a second of a core for about so many cells.
constexpr size_t kMostCellsTried = 40'000;

bool HasVertex(const CellFace& face, int32_t v) {
  return std::find(face.v.begin(), face.v.begin() + face.count, v) != face.v.begin() + face.count;
}

Vec3d MiddleOf(const CellFace& face, const std::vector<Vec3d>& vertices) {
  Vec3d middle;
  for (int j = 0; j < face.count; ++j) middle += vertices[face.v[j]];
  return middle / face.count;
}

double DistanceToFace(const Vec3d& p, const CellFace& face, const std::vector<Vec3d>& vertices) {
  const Vec3d middle = MiddleOf(face, vertices);
  double least = 1e300;
  for (int j = 0; j < face.count; ++j) {
    const Vec3d& a = vertices[face.v[j]];
    const Vec3d& b = vertices[face.v[(j + 1) % face.count]];
    least = std::min(least, Norm(p - ClosestPointOnTriangle(p, a, b, middle)));
  }
  return least;
}

double MinimumOf(const CellComplex& complex) {
  double minimum = 1;
  for (const CellCorners& cell : complex.cells) {
    minimum = std::min(minimum, CellQuality(cell, complex.vertices));
  }
  return minimum;
}

// What a new vertex divides: a face of the boundary, or an edge where two of them meet.
struct Seat {
  std::vector<int> cells;        // all that have it, ascending
  std::vector<int32_t> corners;  // of the face, or both of the edge
  bool IsEdge() const { return corners.size() == 2; }
  bool IsIn(const CellFace& face) const {
    return std::all_of(corners.begin(), corners.end(),
                       [&](int32_t v) { return HasVertex(face, v); });
  }
};

// The face of the boundary that is nearest to a point, and its edges.
std::vector<Seat> SeatsAt(const Vec3d& p, const CellComplex& complex, const WorkingMesh& whole,
                          const CellLists& cells_at) {
  const CellFace* nearest = nullptr;
  double least = 1e300;
  for (const CellFace& face : complex.hull_faces) {
    const double distance = DistanceToFace(p, face, complex.vertices);
    if (distance >= least) continue;
    least = distance;
    nearest = &face;
  }
  std::vector<Seat> seats;
  if (nearest == nullptr) return seats;
  const std::vector<int32_t> corners(nearest->v.begin(), nearest->v.begin() + nearest->count);
  seats.push_back({{whole.Owner(*nearest)}, corners});
  for (size_t j = 0; j < corners.size(); ++j) {
    const int32_t a = corners[j], b = corners[(j + 1) % corners.size()];
    Seat seat{{}, {a, b}};
    for (const int cell : cells_at[a]) {
      if (HasEdge(whole.corners(cell), a, b)) seat.cells.push_back(cell);
    }
    seats.push_back(std::move(seat));
  }
  return seats;
}

// A seat with everything around it that placing its vertex may look at.
class SeatExcerpt {
 public:
  SeatExcerpt(const WorkingMesh& whole, const CellLists& cells_at, const Seat& seat)
      : excerpt_(whole, Around(whole, cells_at, seat.cells, kMovingRings + kSeenRings)),
        seat_(seat) {
    const std::vector<int> moving = Around(whole, cells_at, seat.cells, kMovingRings);
    fixed_.assign(excerpt_.vertices().size(), 0);
    for (const int cell : excerpt_.cells()) {
      if (std::binary_search(moving.begin(), moving.end(), cell)) continue;
      for (const int32_t v : excerpt_.complex().cells[excerpt_.CellOf(cell)]) fixed_[v] = 1;
    }
    for (int& cell : seat_.cells) cell = excerpt_.CellOf(cell);
    const std::vector<int32_t>& known = excerpt_.vertices();
    for (int32_t& v : seat_.corners) {
      v = static_cast<int32_t>(std::lower_bound(known.begin(), known.end(), v) - known.begin());
    }
  }

  const Excerpt& excerpt() const { return excerpt_; }

  // With a vertex in the seat, if its cells are worth having.
  std::optional<CellComplex> WithVertex(const Vec3d& at, const HullFeatures& features,
                                        PlacementEffort effort, const RunContext& run) const {
    CellComplex divided = Divided(at);
    if (!excerpt_.TakeBack(&divided)) return std::nullopt;
    auto placed = PlacePart(std::move(divided), fixed_, features, run, effort);
    if (!placed.ok()) return std::nullopt;
    const double floor = std::min(kLeastQuality, MinimumOf(excerpt_.complex()));
    if (MinimumOf(*placed) < floor) return std::nullopt;
    return *std::move(placed);
  }

 private:
  static std::vector<int> Around(const WorkingMesh& whole, const CellLists& cells_at,
                                 std::vector<int> cells, int rings) {
    for (int ring = 0; ring < rings; ++ring) cells = WithRing(whole, cells_at, cells);
    return cells;
  }

  // The seat's cells become cells around the vertex.
  CellComplex Divided(const Vec3d& at) const {
    const CellComplex closed = excerpt_.Closed();
    const auto apex = static_cast<int32_t>(closed.vertices.size());
    CellComplex divided;
    divided.vertices = closed.vertices;
    divided.vertices.push_back(at);
    for (size_t c = 0; c < closed.cells.size(); ++c) {
      if (!std::binary_search(seat_.cells.begin(), seat_.cells.end(), static_cast<int>(c))) {
        divided.cells.push_back(closed.cells[c]);
        continue;
      }
      for (const CellFace& face : FacesOf(closed.cells[c])) {
        if (seat_.IsIn(face)) continue;
        divided.cells.push_back(face.count == 4
                                    ? MakePyramid(face.v, apex)
                                    : MakeTetrahedronOn({face.v[0], face.v[1], face.v[2]}, apex));
      }
    }
    for (const CellFace& face : closed.hull_faces) {
      if (!seat_.IsIn(face)) {
        divided.hull_faces.push_back(face);
        continue;
      }
      for (int j = 0; j < face.count; ++j) {
        const CellFace side{3, {face.v[j], face.v[(j + 1) % face.count], apex, -1}};
        if (!seat_.IsEdge() || !seat_.IsIn(side)) divided.hull_faces.push_back(side);
      }
    }
    return divided;
  }

  Excerpt excerpt_;
  Seat seat_;                   // in numbers of the excerpt
  std::vector<uint8_t> fixed_;  // [vertex of the excerpt]
};

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
    const size_t cell_count = complex_.cells.size();
    std::vector<Gap> places = Places();
    if (CountNear(places) > most_places_) {
      if (IsLast()) return std::nullopt;
      beyond_ = kFarShare * limits_.limit;
      places = Places();
    }
    std::vector<Gap> tried;
    size_t resisting = 0;
    for (; CountNear(places) + tried.size() <= most_places_; places = Places()) {
      const auto next = std::find_if(places.begin(), places.end(), [&](const Gap& place) {
        return std::none_of(tried.begin(), tried.end(),
                            [&](const Gap& other) { return AreSame(place, other); });
      });
      if (next == places.end()) break;
      tried.push_back(*next);
      AMHEX_ASSIGN_OR_RETURN(const bool is_split, SplitAt(*next));
      if (!is_split && IsLast() && ++resisting == kMostResistingAtLast) return std::nullopt;
    }
    if (complex_.cells.size() == cell_count) return std::nullopt;
    // Regains what the cells around have lost. Elsewhere the hull has been followed before.
    std::vector<Vec3d> around;
    around.reserve(tried.size());
    for (const Gap& gap : tried) around.push_back(gap.sample);
    return FollowHullAround(around, std::move(complex_), hull_, features_, run_);
  }

 private:
  // The whole mesh with a vertex more, and the largest distance there.
  struct Candidate {
    CellComplex complex;
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
    std::vector<Candidate> candidates = Candidates(on_hull, on_mesh);
    AMHEX_RETURN_IF_ERROR(run_.CheckStop());
    const double excess = std::max(0.0, gap.distance - limits_.limit);
    const double wanted = gap.distance - kWorthwhileShare * excess;
    if (candidates.size() > kTriesPerPlace) candidates.resize(kTriesPerPlace);
    for (Candidate& candidate : candidates) {
      cells_tried_ += candidate.complex.cells.size();
      if (cells_tried_ > kMostCellsTried) break;
      DrawAt(on_hull, candidate.complex);
      AMHEX_RETURN_IF_ERROR(run_.CheckStop());
      if (DistanceAt(on_hull, candidate.complex, poll) > wanted) continue;
      const WorkingMesh changed(candidate.complex, poll);
      if (!FindBoundaryDefects(changed, hull_, poll).vertices.empty()) continue;
      complex_ = std::move(candidate.complex);
      return true;
    }
    return false;
  }

  // Nearest to the hull first.
  std::vector<Candidate> Candidates(const Vec3d& on_hull, const Vec3d& on_mesh) const {
    const StopPoll poll(run_);
    const WorkingMesh whole(complex_, poll);
    const CellLists cells_at = whole.CellsAtVertices(poll);
    const std::vector<Seat> seats = SeatsAt(on_mesh, complex_, whole, cells_at);
    constexpr std::array kEfforts = {PlacementEffort::kJoint, PlacementEffort::kRaise};
    std::vector<std::optional<Candidate>> found(seats.size() * kEfforts.size());
    oneapi::tbb::parallel_for(size_t{0}, found.size(), [&](size_t i) {
      if (run_.ShouldStop()) return;
      const SeatExcerpt seat(whole, cells_at, seats[i / kEfforts.size()]);
      const auto part = seat.WithVertex(on_hull, features_, kEfforts[i % kEfforts.size()], run_);
      WorkingMesh changed = whole;
      if (!part.has_value() || !seat.excerpt().PutInto(*part, &changed)) return;
      found[i] = {changed.ToComplex(poll), LargestDistance(*part, on_hull)};
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

  // Draws what is beyond the limit there to the hull.
  void DrawAt(const Vec3d& place, CellComplex& complex) const {
    const StopPoll poll(run_);
    Placement placement = PreparePlacement(complex, features_, poll);
    const HullSampling sampling(hull_, placement, poll);
    std::vector<Gap> gaps = sampling.GapsBeyond(limits_.limit, poll, Detail());
    std::erase_if(gaps, [&](const Gap& gap) { return Norm(gap.sample - place) > kSeenAround; });
    if (IsLast()) gaps = DistinctGaps(gaps, poll);
    if (!gaps.empty())
      JointDraw(placement, sampling, limits_, kLeastQuality, Detail()).Run(gaps, run_);
  }

  // The largest distance beyond the limit there; 0 if there is none.
  double DistanceAt(const Vec3d& place, CellComplex& complex, const StopPoll& poll) const {
    Placement placement = PreparePlacement(complex, features_, poll);
    const HullSampling sampling(hull_, placement, poll);
    for (const Gap& gap : sampling.GapsBeyond(limits_.limit, poll, Detail())) {
      if (Norm(gap.sample - place) < kSeenAround) return gap.distance;
    }
    return 0;
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
