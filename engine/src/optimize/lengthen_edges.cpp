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

namespace amhex {
namespace {

using Edge = std::array<int32_t, 2>;

// What lengthens one edge may shorten the next.
constexpr int kRounds = 3;
// As draw_rest.
constexpr double kLeastQuality = 0.31;
// Better minima than this are no better to have (place_vertices: levels end there).
constexpr double kMostFloor = 0.8;
// What the cells around may lack more than before, in sum, where vertices inside make room.
constexpr double kMostLoss = 0.5;
// Longer than asked for by this share, so that rounding on the way to the user's frame leaves it.
constexpr double kAmple = 1.001;

double LengthOf(const Edge& edge, const std::vector<Vec3d>& vertices) {
  return Norm(vertices[edge[1]] - vertices[edge[0]]);
}

// Each once, ascending.
std::vector<Edge> ShortEdges(const CellComplex& complex, const StopPoll& poll) {
  std::vector<Edge> found;
  for (size_t c = 0; c < complex.cells.size(); ++c) {
    poll.At(static_cast<int64_t>(c));
    for (const Edge& edge : EdgesOf(complex.cells[c])) {
      if (LengthOf(edge, complex.vertices) < kShortestEdge) found.push_back(edge);
    }
  }
  SortUnique(found);
  return found;
}

class EdgeLengthener {
 public:
  EdgeLengthener(Placement& placement, const Hull& hull, double floor)
      : placement_(placement),
        hull_(hull),
        free_(LimitsFor(hull).free),
        floor_(floor),
        press_(placement, floor) {}

  // Whether the edge is long enough then.
  bool Run(const Edge& edge) {
    const std::vector<Vec3d>& x = placement_.complex.vertices;
    if (x[edge[0]] == x[edge[1]]) return false;  // no direction to go on
    const Vec3d along = Normalized(x[edge[1]] - x[edge[0]]) * (kShortestEdge * kAmple);
    const std::array<Vec3d, 2> place = {x[edge[1]] - along, x[edge[0]] + along};
    std::vector<Move> moves;
    for (const int end : {0, 1}) {
      if (!IsPermitted(edge[end], place[end])) continue;
      moves.push_back({edge[end], place[end], QualityAt(edge[end], place[end])});
    }
    // Inside before on a face before on a crease; of the same kind the better one.
    std::sort(moves.begin(), moves.end(), [this](const Move& a, const Move& b) {
      return KindOf(a.vertex) != KindOf(b.vertex) ? KindOf(a.vertex) < KindOf(b.vertex)
                                                  : a.quality > b.quality;
    });
    for (const Move& move : moves) {
      if (PutAt(move)) return true;
    }
    return std::any_of(moves.begin(), moves.end(), [this](const Move& move) {
      return press_.Run(move.vertex, move.place, kMostLoss);
    });
  }

 private:
  struct Move {
    int32_t vertex = -1;
    Vec3d place;
    double quality = 0;  // of the worst cell there
  };

  Constraint KindOf(int32_t vertex) const { return placement_.constraints.vertex[vertex].kind; }

  bool IsPermitted(int32_t vertex, const Vec3d& place) const {
    const Constraint kind = KindOf(vertex);
    if (kind == Constraint::kFree) return true;
    if (kind == Constraint::kFixed) return false;
    const double before = hull_.queries->Closest(placement_.complex.vertices[vertex]).distance;
    return hull_.queries->Closest(place).distance <= std::max(free_, before);
  }

  // The least of the cells there, were the vertex at `place`.
  double QualityAt(int32_t vertex, const Vec3d& place) {
    std::vector<Vec3d>& x = placement_.complex.vertices;
    const Vec3d start = std::exchange(x[vertex], place);
    double least = 1;
    for (const int32_t c : placement_.neighbourhoods.cells[vertex]) {
      least = std::min(least, CellQuality(placement_.complex.cells[c], x));
    }
    x[vertex] = start;
    return least;
  }

  // Alone, if the cells there are good enough then.
  bool PutAt(const Move& move) {
    Vec3d& at = placement_.complex.vertices[move.vertex];
    if (move.quality < std::min(floor_, QualityAt(move.vertex, at))) return false;
    at = move.place;
    return true;
  }

  Placement& placement_;
  const Hull& hull_;
  const double free_;
  const double floor_;
  VertexPress press_;
};

}  // namespace

absl::StatusOr<CellComplex> LengthenEdges(CellComplex complex, const Hull& hull,
                                          const HullFeatures& features, const RunContext& run) {
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  const StopPoll poll(run);
  std::vector<Edge> edges = ShortEdges(complex, poll);
  if (edges.empty()) return complex;
  const std::vector<Vec3d> before = complex.vertices;
  const double minimum = SummarizeQuality(complex, poll).minimum;
  Placement placement = PreparePlacement(complex, features, poll);
  // The minimum is given up only for what cannot be had with it.
  for (const double floor : {std::clamp(minimum, kLeastQuality, kMostFloor), kLeastQuality}) {
    EdgeLengthener lengthener(placement, hull, floor);
    for (int round = 0; round < kRounds && !edges.empty(); ++round) {
      bool any = false;
      for (const Edge& edge : edges) {
        if (absl::Status status = run.CheckStop(); !status.ok()) return status;
        if (LengthOf(edge, complex.vertices) >= kShortestEdge) continue;
        if (lengthener.Run(edge)) any = true;
      }
      if (!any) break;
      edges = ShortEdges(complex, poll);
    }
  }
  TakeBackDefects(hull, before, poll, &complex);
  return complex;
}

}  // namespace amhex
