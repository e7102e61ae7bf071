#include "optimize/edge_lengthener.h"

#include <algorithm>
#include <utility>

#include "closure/working_mesh.h"
#include "input/hull_queries.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// Of the limit: distances are measured at other places than these, too (as draw_rest).
constexpr double kMargin = 0.94;
// Longer than asked for by this share, so that rounding on the way to the user's frame leaves it.
constexpr double kAmple = 1.001;

}  // namespace

EdgeLengthener::EdgeLengthener(Placement& placement, const HullSampling& sampling,
                               const LengthAim& aim)
    : placement_(placement),
      sampling_(sampling),
      limits_(LimitsFor(sampling.hull())),
      aim_(aim),
      press_(placement, aim.floor),
      seen_(placement, sampling, record_.seen) {}

LengthenedEdge& EdgeLengthener::Run(const VertexPair& edge) {
  record_ = {};
  seen_.StartAnew();
  for (const int32_t end : edge) seen_.AddCells(placement_.neighbourhoods.cells[end]);
  record_.is_long_enough = Lengthen(edge);
  return record_;
}

// Whether the edge is long enough then.
bool EdgeLengthener::Lengthen(const VertexPair& edge) {
  const std::vector<Vec3d>& x = placement_.complex.vertices;
  if (x[edge[0]] == x[edge[1]]) return false;  // no direction to go on
  const Vec3d along = Normalized(x[edge[1]] - x[edge[0]]) * (aim_.length * kAmple);
  const std::array<Vec3d, 2> place = {x[edge[1]] - along, x[edge[0]] + along};
  std::vector<Move> moves;
  for (const int end : {0, 1}) {
    if (!IsPermitted(edge[end], place[end])) continue;
    if (ShortensAnother(edge[end], edge[1 - end], place[end])) continue;
    moves.push_back({edge[end], place[end], QualityAt(edge[end], place[end])});
  }
  // Inside before on a face before on a crease; of the same kind the better one.
  std::sort(moves.begin(), moves.end(), [this](const Move& a, const Move& b) {
    return KindOf(a.vertex) != KindOf(b.vertex) ? KindOf(a.vertex) < KindOf(b.vertex)
                                                : a.there.least > b.there.least;
  });
  for (const Move& move : moves) {
    if (PutAt(move)) return true;
  }
  return std::any_of(moves.begin(), moves.end(),
                     [this](const Move& move) { return PressAt(move); });
}

bool EdgeLengthener::IsPermitted(int32_t vertex, const Vec3d& place) {
  const Constraint kind = KindOf(vertex);
  if (kind == Constraint::kFree) return true;
  if (kind == Constraint::kFixed) return false;
  const Vec3d& at = placement_.complex.vertices[vertex];
  const HullQueries& hull = *sampling_.hull().queries;
  if (hull.Closest(place).distance > std::max(limits_.free, hull.Closest(at).distance)) {
    return false;
  }
  VertexDeviation deviation(sampling_, placement_, limits_, vertex);
  seen_.AddFacesNear(at, deviation.reach());
  const double before = deviation.At(at).largest;
  const double creases_before = deviation.worst_of_creases().distance;
  if (deviation.At(place).largest > std::max(kMargin * limits_.limit, before)) return false;
  // An edge so short is worse than a crease that is followed by as much less.
  if (aim_.length <= kUrgentLength) return true;
  return deviation.worst_of_creases().distance <=
         std::max(kMargin * limits_.creases, creases_before);
}

// Whether the vertex at `place` were nearer to one of those it shares an edge with, `other`
// apart, than it is and than is wanted.
bool EdgeLengthener::ShortensAnother(int32_t vertex, int32_t other, const Vec3d& place) const {
  const std::vector<Vec3d>& x = placement_.complex.vertices;
  for (const int32_t c : placement_.neighbourhoods.cells[vertex]) {
    for (const VertexPair& edge : EdgesOf(placement_.complex.cells[c])) {
      if (edge[0] != vertex && edge[1] != vertex) continue;
      const int32_t next = edge[0] == vertex ? edge[1] : edge[0];
      if (next == other) continue;
      const double length = Norm(x[next] - place);
      if (length < aim_.length && length < Norm(x[next] - x[vertex])) return true;
    }
  }
  return false;
}

// Of the cells at the vertex, were it at `place`.
EdgeLengthener::QualityThere EdgeLengthener::QualityAt(int32_t vertex, const Vec3d& place) {
  std::vector<Vec3d>& x = placement_.complex.vertices;
  const Vec3d start = std::exchange(x[vertex], place);
  QualityThere there;
  for (const int32_t c : placement_.neighbourhoods.cells[vertex]) {
    const double quality = CellQuality(placement_.complex.cells[c], x);
    there.least = std::min(there.least, quality);
    there.lack += 1 - quality;
  }
  x[vertex] = start;
  return there;
}

// Alone, if the cells there are good enough then.
bool EdgeLengthener::PutAt(const Move& move) {
  Vec3d& at = placement_.complex.vertices[move.vertex];
  const QualityThere before = QualityAt(move.vertex, at);
  if (move.there.least < std::min(aim_.floor, before.least)) return false;
  if (move.there.lack > before.lack + aim_.most_loss) return false;
  at = move.place;
  record_.moves = {{move.vertex, move.place}};
  return true;
}

// With the vertices inside making room, if edges are the longer for it altogether.
bool EdgeLengthener::PressAt(const Move& move) {
  const std::vector<int32_t>& cells = press_.CellsAround(move.vertex);
  seen_.AddCells(cells);
  const double before = ShortnessOf(cells);
  if (!press_.Run(move.vertex, move.place, aim_.most_loss,
                  [&] { return ShortnessOf(cells) < before; })) {
    return false;
  }
  record_.moves = {{move.vertex, move.place}};
  for (const int32_t inner : press_.inner()) {
    record_.moves.push_back({inner, placement_.complex.vertices[inner]});
  }
  return true;
}

// What edges of these cells lack to the wanted length, in sum.
double EdgeLengthener::ShortnessOf(const std::vector<int32_t>& cells) const {
  double lack = 0;
  for (const int32_t c : cells) {
    for (const VertexPair& edge : EdgesOf(placement_.complex.cells[c])) {
      lack += std::max(0.0, aim_.length - Norm(placement_.complex.vertices[edge[1]] -
                                               placement_.complex.vertices[edge[0]]));
    }
  }
  return lack;
}

}  // namespace amhex
