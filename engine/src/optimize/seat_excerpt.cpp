#include "optimize/seat_excerpt.h"

#include <algorithm>
#include <utility>

#include "base/stop_poll.h"
#include "input/triangle_math.h"
#include "optimize/cell_quality.h"
#include "optimize/hull_deviation.h"

namespace amhex {
namespace {

// Rings of cells around the new ones: vertices of the first may move, the others are there to be
// seen by corners of the hull (place_refill.cpp).
constexpr int kMovingRings = 2;
constexpr int kSeenRings = 2;

bool HasVertex(const CellFace& face, int32_t v) {
  return std::find(face.v.begin(), face.v.begin() + face.count, v) != face.v.begin() + face.count;
}

double LeastQualityOf(const CellComplex& complex) {
  double least = 1;
  for (const CellCorners& cell : complex.cells) {
    least = std::min(least, CellQuality(cell, complex.vertices));
  }
  return least;
}

std::vector<int> RingsAround(const WorkingMesh& whole, const CellLists& cells_at,
                             std::vector<int> cells, int rings) {
  for (int ring = 0; ring < rings; ++ring) cells = WithRing(whole, cells_at, cells);
  return cells;
}

}  // namespace

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

bool Seat::IsIn(const CellFace& face) const {
  return std::all_of(corners.begin(), corners.end(), [&](int32_t v) { return HasVertex(face, v); });
}

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

SeatExcerpt::SeatExcerpt(const WorkingMesh& whole, const CellLists& cells_at, const Seat& seat)
    : excerpt_(whole, RingsAround(whole, cells_at, seat.cells, kMovingRings + kSeenRings)),
      seat_(seat) {
  const std::vector<int> moving = RingsAround(whole, cells_at, seat.cells, kMovingRings);
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

std::optional<CellComplex> SeatExcerpt::WithVertex(const Vec3d& at, const HullFeatures& features,
                                                   PlacementEffort effort,
                                                   const RunContext& run) const {
  CellComplex divided = Divided(at);
  if (!excerpt_.TakeBack(&divided)) return std::nullopt;
  auto placed = PlacePart(std::move(divided), fixed_, features, run, effort);
  if (!placed.ok()) return std::nullopt;
  const double floor = std::min(kBearable, LeastQualityOf(excerpt_.complex()));
  if (LeastQualityOf(*placed) < floor) return std::nullopt;
  return *std::move(placed);
}

std::optional<CellComplex> SeatExcerpt::Raised(CellComplex part, const HullFeatures& features,
                                               const RunContext& run) const {
  auto raised = PlacePart(std::move(part), fixed_, features, run, PlacementEffort::kRaise);
  if (!raised.ok()) return std::nullopt;
  return *std::move(raised);
}

std::optional<CellComplex> SeatExcerpt::InWhole(const WorkingMesh& whole, const CellComplex& part,
                                                const StopPoll& poll) const {
  WorkingMesh changed = whole;
  if (!excerpt_.PutInto(part, &changed)) return std::nullopt;
  return changed.ToComplex(poll);
}

CellComplex SeatExcerpt::Divided(const Vec3d& at) const {
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

}  // namespace amhex
