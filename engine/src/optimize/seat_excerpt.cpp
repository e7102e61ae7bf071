#include "optimize/seat_excerpt.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <numeric>
#include <utility>

#include "base/sort_unique.h"
#include "base/stop_poll.h"
#include "closure/close_complex.h"
#include "input/hull_queries.h"
#include "input/triangle_math.h"
#include "optimize/cell_quality.h"
#include "optimize/hull_deviation.h"

namespace amhex {
namespace {

// Rings of cells around the new ones: vertices of the first may move, the others are there to be
// seen by corners of the hull (place_refill.cpp).
constexpr int kMovingRings = 2;
constexpr int kSeenRings = 2;
// Cells that may go at once. Around a vertex of a flat boundary there are four.
constexpr size_t kMostCutOff = 4;
// The same over a groove, where those at one vertex are all that is between its sides.
constexpr size_t kMostOverGroove = 8;

bool HasVertex(const CellFace& face, int32_t v) {
  return std::find(face.v.begin(), face.v.begin() + face.count, v) != face.v.begin() + face.count;
}

// Around a new vertex, on a face whose outward side is the new cell's, too.
CellCorners CellOn(const CellFace& face, int32_t apex) {
  return face.count == 4 ? MakePyramid(face.v, apex)
                         : MakeTetrahedronOn({face.v[0], face.v[1], face.v[2]}, apex);
}

bool AreSameFace(const CellFace& a, const CellFace& b) {
  return a.count == b.count && std::all_of(a.v.begin(), a.v.begin() + a.count,
                                           [&](int32_t v) { return HasVertex(b, v); });
}

// Whether the faces hang together by their edges and have the topology of a disc.
bool IsDisc(const std::vector<CellFace>& faces) {
  std::vector<int32_t> vertices;
  std::vector<size_t> group(faces.size());
  std::iota(group.begin(), group.end(), 0);
  std::map<std::array<int32_t, 2>, size_t> face_at;
  for (size_t f = 0; f < faces.size(); ++f) {
    for (int j = 0; j < faces[f].count; ++j) {
      const int32_t a = faces[f].v[j], b = faces[f].v[(j + 1) % faces[f].count];
      vertices.push_back(a);
      const auto [at, is_new] = face_at.try_emplace({std::min(a, b), std::max(a, b)}, f);
      const size_t other = group[at->second], own = group[f];
      if (!is_new) std::replace(group.begin(), group.end(), other, own);
    }
  }
  SortUnique(vertices);
  const bool is_one =
      std::all_of(group.begin(), group.end(), [&](size_t g) { return g == group.front(); });
  return is_one && vertices.size() + faces.size() == face_at.size() + 1;
}

double LeastQualityOf(const CellComplex& complex) {
  double least = 1;
  for (const CellCorners& cell : complex.cells) {
    least = std::min(least, CellQuality(cell, complex.vertices));
  }
  return least;
}

// Sum of the area vectors of the vertex' faces.
Vec3d OutwardAt(int32_t v, const CellComplex& complex) {
  const std::vector<Vec3d>& at = complex.vertices;
  Vec3d outward;
  for (const CellFace& face : complex.hull_faces) {
    if (!HasVertex(face, v)) continue;
    for (int j = 2; j < face.count; ++j) {
      outward += Cross(at[face.v[j - 1]] - at[face.v[0]], at[face.v[j]] - at[face.v[0]]);
    }
  }
  return outward;
}

std::vector<int> RingsAround(const WorkingMesh& whole, const CellLists& cells_at,
                             std::vector<int> cells, int rings) {
  for (int ring = 0; ring < rings; ++ring) cells = WithRing(whole, cells_at, cells);
  return cells;
}

// Of the boundary; null where there is none.
const CellFace* NearestFace(const Vec3d& p, const CellComplex& complex) {
  const CellFace* nearest = nullptr;
  double least = 1e300;
  for (const CellFace& face : complex.hull_faces) {
    const double distance = DistanceToFace(p, face, complex.vertices);
    if (distance >= least) continue;
    least = distance;
    nearest = &face;
  }
  return nearest;
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

Seat SeatInEdge(int32_t a, int32_t b, const WorkingMesh& whole, const CellLists& cells_at) {
  Seat seat{SeatUse::kDivide, {}, {a, b}};
  std::copy_if(cells_at[a].begin(), cells_at[a].end(), std::back_inserter(seat.cells),
               [&](int cell) { return HasEdge(whole.corners(cell), a, b); });
  return seat;
}

std::vector<Seat> SeatsAt(const Vec3d& p, const Vec3d& wanted, const CellComplex& complex,
                          const WorkingMesh& whole, const CellLists& cells_at) {
  const CellFace* const nearest = NearestFace(p, complex);
  std::vector<Seat> seats;
  if (nearest == nullptr) return seats;
  const std::vector<int32_t> corners(nearest->v.begin(), nearest->v.begin() + nearest->count);
  seats.push_back({SeatUse::kDivide, {whole.Owner(*nearest)}, corners});
  for (size_t j = 0; j < corners.size(); ++j) {
    const int32_t a = corners[j], b = corners[(j + 1) % corners.size()];
    seats.push_back(SeatInEdge(a, b, whole, cells_at));
  }
  const int32_t v = *std::min_element(corners.begin(), corners.end(), [&](int32_t a, int32_t b) {
    return Norm(complex.vertices[a] - p) < Norm(complex.vertices[b] - p);
  });
  const bool is_too_far_out = Dot(OutwardAt(v, complex), wanted - p) < 0;
  const bool may_go = is_too_far_out && cells_at[v].size() <= kMostCutOff;
  seats.push_back({may_go ? SeatUse::kCutOff : SeatUse::kRefill, cells_at[v], {v}});
  return seats;
}

std::vector<Seat> SeatsUnder(const Vec3d& p, const CellComplex& complex, const WorkingMesh& whole,
                             const CellLists& cells_at, const HullQueries& hull) {
  std::vector<Seat> seats;
  const CellFace* const nearest = NearestFace(p, complex);
  if (nearest == nullptr) return seats;
  const auto is_of_boundary = [&](int32_t v) {
    return std::any_of(complex.hull_faces.begin(), complex.hull_faces.end(),
                       [&](const CellFace& face) { return HasVertex(face, v); });
  };
  const auto is_outside = [&](int cell) {
    const CellFaces faces = FacesOf(whole.corners(cell));
    const bool has_boundary = std::any_of(faces.begin(), faces.end(), [&](const CellFace& face) {
      return whole.Across(face) == WorkingMesh::kHull;
    });
    return has_boundary && !hull.IsInside(CellCentroid(whole.corners(cell), whole.vertices()));
  };
  for (const int32_t v : VerticesOf(whole.corners(whole.Owner(*nearest)))) {
    if (is_of_boundary(v)) continue;
    Seat seat{SeatUse::kCutOff, {}, {v}};
    std::copy_if(cells_at[v].begin(), cells_at[v].end(), std::back_inserter(seat.cells),
                 is_outside);
    if (!seat.cells.empty() && seat.cells.size() <= kMostOverGroove) {
      seats.push_back(std::move(seat));
    }
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

std::optional<CellComplex> SeatExcerpt::Changed(const Vec3d& at, PlacementEffort effort,
                                                const RefillWith& with) const {
  std::optional<CellComplex> changed;
  switch (seat_.use) {
    case SeatUse::kDivide:
      changed = Divided(at);
      break;
    case SeatUse::kRefill:
      changed = Refilled(with);
      break;
    case SeatUse::kCutOff:
      changed = CutOff();
      break;
  }
  if (!changed.has_value() || !excerpt_.TakeBack(&*changed)) return std::nullopt;
  auto placed = PlacePart(*std::move(changed), fixed_, with.features, with.run, effort);
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
      if (!seat_.IsIn(face)) divided.cells.push_back(CellOn(face, apex));
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

std::optional<CellComplex> SeatExcerpt::Refilled(const RefillWith& with) const {
  const Opening opening{{seat_.cells.begin(), seat_.cells.end()}};
  auto refilled = RefillOpening(excerpt_.Closed(), with.hull, opening, with.params, with.run);
  if (!refilled.ok()) return std::nullopt;
  return std::move(refilled->complex);
}

std::optional<CellComplex> SeatExcerpt::CutOff() const {
  const CellComplex closed = excerpt_.Closed();
  CellComplex rest;
  rest.vertices = closed.vertices;
  std::vector<CellFace> gone;  // outward faces of what goes
  for (size_t c = 0; c < closed.cells.size(); ++c) {
    if (!std::binary_search(seat_.cells.begin(), seat_.cells.end(), static_cast<int>(c))) {
      rest.cells.push_back(closed.cells[c]);
      continue;
    }
    const CellFaces faces = FacesOf(closed.cells[c]);
    gone.insert(gone.end(), faces.begin(), faces.end());
  }
  const auto is_gone = [&](const CellFace& face) {
    return std::any_of(gone.begin(), gone.end(),
                       [&](const CellFace& other) { return AreSameFace(face, other); });
  };
  std::vector<CellFace> bare;
  for (const CellFace& face : gone) {
    const auto same = [&](const CellFace& other) { return AreSameFace(face, other); };
    const bool is_between = std::count_if(gone.begin(), gone.end(), same) > 1;
    const bool is_hull = std::any_of(closed.hull_faces.begin(), closed.hull_faces.end(), same);
    if (!is_between && !is_hull) bare.push_back(Reversed(face));
  }
  if (!IsDisc(bare)) return std::nullopt;
  std::copy_if(closed.hull_faces.begin(), closed.hull_faces.end(),
               std::back_inserter(rest.hull_faces),
               [&](const CellFace& face) { return !is_gone(face); });
  rest.hull_faces.insert(rest.hull_faces.end(), bare.begin(), bare.end());
  return rest;
}

}  // namespace amhex
