#include "optimize/lengthen_edges.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/sort_unique.h"
#include "closure/working_mesh.h"
#include "input/hull_queries.h"
#include "optimize/cell_quality.h"
#include "optimize/hull_deviation.h"
#include "optimize/placement.h"
#include "optimize/press_vertex.h"
#include "optimize/raise_quality.h"
#include "optimize/take_back_defects.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

using Edge = std::array<int32_t, 2>;

// What lengthens one edge may shorten the next.
constexpr int kRounds = 3;
// As draw_rest.
constexpr double kLeastQuality = 0.31;
// A cell that poor is better than one with an edge of next to no length.
constexpr double kLeastAtLast = 0.3;
// Better minima than this are no better to have (place_vertices: levels end there).
constexpr double kMostFloor = 0.8;
// Of the limit: distances are measured at other places than these, too (as draw_rest).
constexpr double kMargin = 0.94;
// Edges that are to be this long are lengthened along or away from a crease, whatever that does to
// it, and the mesh's minimum, if it is below kMinimumToKeep, is given up to this share of it.
constexpr double kUrgentLength = 0.05;
constexpr double kMinimumToKeep = 0.5;
constexpr double kUrgentShare = 0.8;
// Longer than asked for by this share, so that rounding on the way to the user's frame leaves it.
constexpr double kAmple = 1.001;

// On the way to kWantedEdge: cells that have made room for a shorter edge make more for the next.
constexpr std::array<double, 7> kSteps = {0.02, 0.03, 0.05, 0.07, 0.1, 0.15, kWantedEdge};

struct LengthAim {
  double length = 0;  // edges are to be so long
  double floor = 0;   // no cell that is better falls below
  // What the cells around may lack more than before, in sum, to a scaled Jacobian of 1.
  double most_loss = 0;
};

// First what must be, then what is good to have.
std::vector<LengthAim> AimsFor(double minimum) {
  constexpr double kMostLossForShortest = 0.5;
  constexpr double kMostLossForWanted = 0.1;
  std::vector<LengthAim> aims;
  // The minimum is given up only for what cannot be had with it.
  for (const double floor : {std::clamp(minimum, kLeastQuality, kMostFloor), kLeastAtLast}) {
    aims.push_back({kShortestEdge, floor, kMostLossForShortest});
  }
  const double floor = std::max(minimum, kLeastQuality);
  const double urgent =
      minimum > kMinimumToKeep ? floor : std::max(kUrgentShare * minimum, kLeastQuality);
  for (const double length : kSteps) {
    aims.push_back({length, length <= kUrgentLength ? urgent : floor, kMostLossForWanted});
  }
  return aims;
}

double LengthOf(const Edge& edge, const std::vector<Vec3d>& vertices) {
  return Norm(vertices[edge[1]] - vertices[edge[0]]);
}

// Each once, ascending.
std::vector<Edge> EdgesBelow(double length, const CellComplex& complex, const StopPoll& poll) {
  std::vector<Edge> found;
  for (size_t c = 0; c < complex.cells.size(); ++c) {
    poll.At(static_cast<int64_t>(c));
    const CellCorners& corners = complex.cells[c];
    for (const auto& [i, j] : kCubeEdges) {
      const Vec3d along = complex.vertices[corners[j]] - complex.vertices[corners[i]];
      if (SquaredNorm(along) >= length * length || corners[i] == corners[j]) continue;
      found.push_back({std::min(corners[i], corners[j]), std::max(corners[i], corners[j])});
    }
  }
  SortUnique(found);
  return found;
}

class EdgeLengthener {
 public:
  EdgeLengthener(Placement& placement, const HullSampling& sampling, const LengthAim& aim)
      : placement_(placement),
        sampling_(sampling),
        limits_(LimitsFor(sampling.hull())),
        aim_(aim),
        press_(placement, aim.floor) {}

  // Whether the edge is long enough then.
  bool Run(const Edge& edge) {
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

 private:
  struct QualityThere {
    double least = 1;
    double lack = 0;  // to 1, in sum
  };
  struct Move {
    int32_t vertex = -1;
    Vec3d place;
    QualityThere there;
  };

  Constraint KindOf(int32_t vertex) const { return placement_.constraints.vertex[vertex].kind; }

  bool IsPermitted(int32_t vertex, const Vec3d& place) const {
    const Constraint kind = KindOf(vertex);
    if (kind == Constraint::kFree) return true;
    if (kind == Constraint::kFixed) return false;
    const Vec3d& at = placement_.complex.vertices[vertex];
    const HullQueries& hull = *sampling_.hull().queries;
    if (hull.Closest(place).distance > std::max(limits_.free, hull.Closest(at).distance)) {
      return false;
    }
    VertexDeviation deviation(sampling_, placement_, limits_, vertex);
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
  bool ShortensAnother(int32_t vertex, int32_t other, const Vec3d& place) const {
    const std::vector<Vec3d>& x = placement_.complex.vertices;
    for (const int32_t c : placement_.neighbourhoods.cells[vertex]) {
      for (const Edge& edge : EdgesOf(placement_.complex.cells[c])) {
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
  QualityThere QualityAt(int32_t vertex, const Vec3d& place) {
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
  bool PutAt(const Move& move) {
    Vec3d& at = placement_.complex.vertices[move.vertex];
    const QualityThere before = QualityAt(move.vertex, at);
    if (move.there.least < std::min(aim_.floor, before.least)) return false;
    if (move.there.lack > before.lack + aim_.most_loss) return false;
    at = move.place;
    return true;
  }

  // With the vertices inside making room, if edges are the longer for it altogether.
  bool PressAt(const Move& move) {
    const std::vector<int32_t>& cells = press_.CellsAround(move.vertex);
    const double before = ShortnessOf(cells);
    return press_.Run(move.vertex, move.place, aim_.most_loss,
                      [&] { return ShortnessOf(cells) < before; });
  }

  // What edges of these cells lack to the wanted length, in sum.
  double ShortnessOf(const std::vector<int32_t>& cells) const {
    double lack = 0;
    for (const int32_t c : cells) {
      for (const Edge& edge : EdgesOf(placement_.complex.cells[c])) {
        lack += std::max(0.0, aim_.length - LengthOf(edge, placement_.complex.vertices));
      }
    }
    return lack;
  }

  Placement& placement_;
  const HullSampling& sampling_;
  const DeviationLimits limits_;
  const LengthAim aim_;
  VertexPress press_;
};

}  // namespace

absl::StatusOr<CellComplex> LengthenEdges(CellComplex complex, const Hull& hull,
                                          const HullFeatures& features, const RunContext& run) {
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  const StopPoll poll(run);
  if (EdgesBelow(kWantedEdge, complex, poll).empty()) return complex;
  const std::vector<Vec3d> before = complex.vertices;
  const double minimum = SummarizeQuality(complex, poll).minimum;
  Placement placement = PreparePlacement(complex, features, poll);
  const HullSampling sampling(hull, placement, poll);
  std::vector<Edge> stuck;  // which stayed shorter than was wanted last: more cannot be had
  for (const LengthAim& aim : AimsFor(minimum)) {
    EdgeLengthener lengthener(placement, sampling, aim);
    std::vector<Edge> failed;
    for (int round = 0; round < kRounds; ++round) {
      bool any = false;
      failed.clear();
      for (const Edge& edge : EdgesBelow(aim.length, complex, poll)) {
        if (absl::Status status = run.CheckStop(); !status.ok()) return status;
        if (std::binary_search(stuck.begin(), stuck.end(), edge)) continue;
        if (LengthOf(edge, complex.vertices) >= aim.length) continue;
        if (lengthener.Run(edge)) {
          any = true;
        } else {
          failed.push_back(edge);
        }
      }
      if (!any) break;
    }
    if (aim.length == kShortestEdge) continue;  // the next may do with poorer cells
    stuck.insert(stuck.end(), failed.begin(), failed.end());
    std::sort(stuck.begin(), stuck.end());
  }
  TakeBackDefects(hull, before, poll, &complex);
  return complex;
}

}  // namespace amhex
