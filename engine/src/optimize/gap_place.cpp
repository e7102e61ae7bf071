#include "optimize/gap_place.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>
#include <utility>

#include "base/sort_unique.h"
#include "input/hull_queries.h"
#include "optimize/draw_jointly.h"
#include "optimize/placement.h"

namespace amhex {
namespace {

// How far around a gap distances are measured: the faces at its vertex reach no farther.
constexpr double kMeasuredAround = 2.0;
// Places that far from the gap are drawn, which moves vertices two rings from a cell and looks at
// cells a ring farther: cells with a corner within this reach, and samples a little beyond.
constexpr double kExcerptReach = 7.0;
constexpr double kSamplesBeyondExcerpt = 1.0;
// Of what a distance is beyond the limit, this must go.
constexpr double kShareToGo = 0.5;
// What has lost less of it before it is drawn is not likely to be drawn near enough.
constexpr double kLikelyShare = 0.1;

// Vertices that come to the boundary where cells go are not on the hull yet.
constexpr size_t kEffortsPerSeat = 2;
std::array<PlacementEffort, kEffortsPerSeat> EffortsFor(SeatUse use) {
  const bool reaches = use != SeatUse::kDivide;
  return {PlacementEffort::kJoint, reaches ? PlacementEffort::kValid : PlacementEffort::kBearable};
}

std::vector<int> CellsWithin(const WorkingMesh& whole, const Vec3d& p) {
  std::vector<int> cells;
  for (size_t v = 0; v < whole.vertices().size(); ++v) {
    if (Norm(whole.vertices()[v] - p) > kExcerptReach) continue;
    whole.AnyCellAt(static_cast<int32_t>(v), [&](int cell) {
      cells.push_back(cell);
      return false;
    });
  }
  SortUnique(cells);
  return cells;
}

}  // namespace

bool IsOfHull(const Gap& gap, const GapsWith& with) {
  return gap.is_of_boundary || with.hull.queries->Closest(gap.sample).distance < with.limits.free;
}

GapPlace::GapPlace(const WorkingMesh& whole, const Gap& gap, const GapsWith& with)
    : gap_(gap),
      with_(with),
      poll_(with.run),
      on_hull_(gap.is_of_boundary ? gap.nearest : gap.sample),
      on_mesh_(gap.is_of_boundary ? gap.sample : gap.nearest),
      excerpt_(whole, CellsWithin(whole, gap.sample)),
      closed_(excerpt_.Closed()) {
  const CellLists cells_at = closed_.CellsAtVertices(poll_);
  std::vector<Seat> seats = SeatsAt(on_mesh_, on_hull_, excerpt_.complex(), closed_, cells_at);
  for (Seat& seat :
       SeatsUnder(on_mesh_, excerpt_.complex(), closed_, cells_at, *with.hull.queries)) {
    seats.push_back(std::move(seat));
  }
  for (const Seat& seat : seats) seats_.emplace_back(closed_, cells_at, seat);
  CellComplex part = excerpt_.complex();
  const Placement placement = Prepare(part);
  samples_ = HullSampling(with.hull, placement, poll_, {{on_hull_}, kMeasuredAround}).points();
}

std::vector<GapPlace::Candidate> GapPlace::Candidates() const {
  std::vector<std::optional<Candidate>> found(seats_.size() * kEffortsPerSeat);
  oneapi::tbb::parallel_for(size_t{0}, found.size(), [&](size_t i) {
    if (with_.run.ShouldStop()) return;
    const size_t seat = i / kEffortsPerSeat;
    const PlacementEffort effort = EffortsFor(seats_[seat].use())[i % kEffortsPerSeat];
    auto part = seats_[seat].Changed(on_hull_, effort, with_);
    if (!part.has_value()) return;
    const double distance = LargestDistance(*part);
    found[i] = {seat, effort, *std::move(part), distance};
  });
  std::vector<Candidate> candidates;
  for (std::optional<Candidate>& candidate : found) {
    if (candidate.has_value()) candidates.push_back(*std::move(candidate));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [this](const Candidate& a, const Candidate& b) {
                     return std::tuple(IsUnlikely(a), IsRefilled(a), a.distance) <
                            std::tuple(IsUnlikely(b), IsRefilled(b), b.distance);
                   });
  return candidates;
}

// What only has bearable cells is raised to the end first: that takes three times as long as to
// find out whether it can have them, and mostly it cannot, or another candidate is nearer.
std::optional<CellComplex> GapPlace::Drawn(Candidate candidate) const {
  const SeatExcerpt& seat = seats_[candidate.seat];
  std::optional<CellComplex> part = std::move(candidate.part);
  if (candidate.effort == PlacementEffort::kBearable) {
    part = seat.Raised(*std::move(part), with_.features, with_.run);
  }
  if (!part.has_value()) return std::nullopt;
  std::optional<CellComplex> drawn = seat.InWhole(closed_, *part, poll_);
  if (!drawn.has_value() || !excerpt_.TakeBack(&*drawn)) return std::nullopt;
  if (Draw(*drawn) > WithoutShare(kShareToGo)) return std::nullopt;
  return drawn;
}

std::optional<WorkingMesh> GapPlace::InWhole(const WorkingMesh& whole,
                                             const CellComplex& drawn) const {
  WorkingMesh changed = whole;
  if (!excerpt_.PutInto(drawn, &changed)) return std::nullopt;
  return changed;
}

std::vector<Gap> GapPlace::GapsIn(CellComplex drawn, double beyond) const {
  const Placement placement = Prepare(drawn);
  std::vector<Gap> gaps = HullSampling(with_.hull, placement, poll_, Sampled())
                              .GapsBeyond(beyond, poll_, with_.detail, Sampled());
  std::erase_if(gaps, [&](const Gap& gap) { return !Covers(gap.sample); });
  return gaps;
}

bool GapPlace::IsUnlikely(const Candidate& candidate) const {
  return candidate.distance > WithoutShare(kLikelyShare);
}

double GapPlace::WithoutShare(double share) const {
  return gap_.distance - share * std::max(0.0, gap_.distance - with_.limits.limit);
}

Surroundings GapPlace::Sampled() const {
  return {{gap_.sample}, kExcerptReach + kSamplesBeyondExcerpt};
}

// Between hull and boundary, either way.
double GapPlace::LargestDistance(const CellComplex& part) const {
  double largest = 0;
  for (const Vec3d& p : samples_) {
    double least = 1e300;
    for (const CellFace& face : part.hull_faces) {
      least = std::min(least, DistanceToFace(p, face, part.vertices));
      if (least <= largest) break;
    }
    largest = std::max(largest, least);
  }
  const auto ask = [&](const Vec3d& p) {
    if (Norm(p - on_hull_) > kMeasuredAround || with_.hull.queries->IsWithin(p, largest)) return;
    largest = with_.hull.queries->Closest(p).distance;
  };
  for (const CellFace& face : part.hull_faces) {
    ask(MiddleOf(face, part.vertices));
    for (int j = 0; j < face.count; ++j) ask(part.vertices[face.v[j]]);
  }
  return largest;
}

double GapPlace::Draw(CellComplex& part) const {
  const RunContext& run = with_.run;
  Placement placement = Prepare(part);
  const auto find_gaps = [&](const HullSampling& sampling) {
    return sampling.GapsBeyond(with_.limits.limit, poll_, with_.detail,
                               {{on_hull_}, kMeasuredAround});
  };
  const HullSampling sampling(with_.hull, placement, poll_, Sampled());
  std::vector<Gap> gaps = find_gaps(sampling);
  if (with_.detail == FaceDetail::kClosely) gaps = DistinctGaps(gaps, poll_);
  if (gaps.empty()) return 0;
  JointDraw(placement, sampling, with_.limits, kBearable, with_.detail).Run(gaps, run);
  gaps = find_gaps(HullSampling(with_.hull, placement, poll_, Sampled()));
  return gaps.empty() ? 0 : gaps.front().distance;
}

// What is cut off stays where it is.
Placement GapPlace::Prepare(CellComplex& part) const {
  Placement placement = PreparePlacement(part, with_.features, poll_);
  for (size_t v = 0; v < excerpt_.vertices().size(); ++v) {
    if (!excerpt_.IsAtCut(static_cast<int32_t>(v))) continue;
    placement.constraints.vertex[v] = {Constraint::kFixed, -1, -1, -1};
  }
  return placement;
}

}  // namespace amhex
