#include "optimize/lengthen_edges.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/sort_unique.h"
#include "optimize/edge_lengthener.h"
#include "optimize/hull_deviation.h"
#include "optimize/look_ahead.h"
#include "optimize/placement.h"
#include "optimize/placement_copy.h"
#include "optimize/raise_quality.h"
#include "optimize/take_back_defects.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

using Edge = VertexPair;

// What lengthens one edge may shorten the next.
constexpr int kRounds = 3;
// As draw_rest.
constexpr double kLeastQuality = 0.31;
// A cell that poor is better than one with an edge of next to no length.
constexpr double kLeastAtLast = 0.3;
// Better minima than this are no better to have (place_vertices: levels end there).
constexpr double kMostFloor = 0.8;
// For edges that are to be urgently longer the mesh's minimum, if it is below kMinimumToKeep, is
// given up to this share of it.
constexpr double kMinimumToKeep = 0.5;
constexpr double kUrgentShare = 0.8;
// Edges this near to one another may well see each other move, edge lengths.
constexpr double kSeesOther = 5.0;
// On the way to kWantedEdge: cells that have made room for a shorter edge make more for the next.
constexpr std::array<double, 7> kSteps = {0.02, 0.03, 0.05, 0.07, 0.1, 0.15, kWantedEdge};

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

// The placement once more, to find out on what would happen to it.
class EdgeRehearsal {
 public:
  EdgeRehearsal(const Placement& original, size_t moves_made)
      : copy_(original), moves_seen_(moves_made) {}

  // Becomes as the original is, of which these vertices have moved so far.
  void CatchUp(const CellComplex& original, const std::vector<int32_t>& moved) {
    for (; moves_seen_ < moved.size(); ++moves_seen_) stale_.push_back(moved[moves_seen_]);
    for (const int32_t v : stale_) copy_.complex.vertices[v] = original.vertices[v];
    stale_.clear();
  }
  void AimAt(const LengthAim& aim, int number, const HullSampling& sampling) {
    if (std::exchange(aim_, number) != number) lengthener_.emplace(copy_.placement, sampling, aim);
  }
  // What lengthening the edge would do.
  LengthenedEdge Run(const Edge& edge) {
    LengthenedEdge record = std::move(lengthener_->Run(edge));
    for (const LengthenedEdge::Move& move : record.moves) stale_.push_back(move.vertex);
    return record;
  }

 private:
  PlacementCopy copy_;
  std::optional<EdgeLengthener> lengthener_;
  int aim_ = 0;  // whose it is
  size_t moves_seen_;
  std::vector<int32_t> stale_;  // vertices that are elsewhere in the original
};

// Lengthens edges one after the other, but each is looked at side by side with others first: what
// was found then holds as long as nothing that it depends on has moved.
class EdgesInTurn {
  struct Found {
    LengthenedEdge record;  // nothing was seen where the edge was long enough
    int64_t looked_at = 0;  // by clock_
  };

  bool IsLong(const Edge& edge) const {
    return LengthOf(edge, placement_.complex.vertices) >= aim_.length;
  }
  bool Holds(const Found& found) const {
    const std::vector<int32_t>& seen = found.record.seen;
    return !seen.empty() && std::all_of(seen.begin(), seen.end(),
                                        [&](int32_t v) { return changed_[v] <= found.looked_at; });
  }

  auto LookAt(const Edge& edge) {
    EdgeRehearsal* rehearsal = nullptr;
    if (!IsLong(edge)) {
      std::unique_ptr<EdgeRehearsal>& own = rehearsals_.local();
      if (own == nullptr) own = std::make_unique<EdgeRehearsal>(placement_, moved_.size());
      own->CatchUp(placement_.complex, moved_);
      own->AimAt(aim_, aim_number_, sampling_);
      rehearsal = own.get();
    }
    return [rehearsal, &edge, looked_at = clock_] {
      Found found{{}, looked_at};
      if (rehearsal != nullptr) found.record = rehearsal->Run(edge);
      return found;
    };
  }

 public:
  EdgesInTurn(Placement& placement, const HullSampling& sampling, const RunContext& run)
      : placement_(placement),
        sampling_(sampling),
        run_(run),
        changed_(placement.complex.vertices.size(), 0) {}

  void AimAt(const LengthAim& aim) {
    aim_ = aim;
    ++aim_number_;
    lengthener_.emplace(placement_, sampling_, aim);
  }

  // Whether any has become long enough; `failed` are those that are not.
  bool Lengthen(const std::vector<Edge>& edges, std::vector<Edge>& failed) {
    bool any = false;
    const auto take = [&](size_t i, std::optional<Found> found) {
      if (IsLong(edges[i])) return true;
      if (Take(edges[i], std::move(found))) {
        any = true;
      } else {
        failed.push_back(edges[i]);
      }
      return true;
    };
    const auto look = [&](size_t i) { return LookAt(edges[i]); };
    const auto holds = [&](size_t i, const Found& found) {
      return IsLong(edges[i]) || Holds(found);
    };
    const auto are_near = [&](size_t i, size_t j) {
      const std::vector<Vec3d>& x = placement_.complex.vertices;
      return Norm(x[edges[i][0]] - x[edges[j][0]]) < kSeesOther;
    };
    TakeLookingAhead<Found>(edges.size(), run_, are_near, look, holds, take);
    return any;
  }

 private:
  // Whether it is long enough then.
  bool Take(const Edge& edge, std::optional<Found> found) {
    const LengthenedEdge& record = found.has_value() ? found->record : lengthener_->Run(edge);
    for (const LengthenedEdge::Move& move : record.moves) {
      placement_.complex.vertices[move.vertex] = move.place;
      changed_[move.vertex] = ++clock_;
      moved_.push_back(move.vertex);
    }
    return record.is_long_enough;
  }

  Placement& placement_;
  const HullSampling& sampling_;
  const RunContext& run_;
  LengthAim aim_;
  int aim_number_ = 0;
  std::optional<EdgeLengthener> lengthener_;
  std::vector<int64_t> changed_;  // [vertex] when it last moved, by clock_
  std::vector<int32_t> moved_;    // vertices, in the order in which they were
  int64_t clock_ = 0;
  oneapi::tbb::enumerable_thread_specific<std::unique_ptr<EdgeRehearsal>> rehearsals_;
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
  EdgesInTurn in_turn(placement, sampling, run);
  for (const LengthAim& aim : AimsFor(minimum)) {
    in_turn.AimAt(aim);
    std::vector<Edge> failed;
    for (int round = 0; round < kRounds; ++round) {
      failed.clear();
      std::vector<Edge> edges = EdgesBelow(aim.length, complex, poll);
      std::erase_if(edges, [&](const Edge& edge) {
        return std::binary_search(stuck.begin(), stuck.end(), edge);
      });
      const bool any = in_turn.Lengthen(edges, failed);
      if (absl::Status status = run.CheckStop(); !status.ok()) return status;
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
