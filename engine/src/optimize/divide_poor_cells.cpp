#include "optimize/divide_poor_cells.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "closure/boundary_defects.h"
#include "closure/cell_qualities.h"
#include "closure/working_mesh.h"
#include "input/hull_queries.h"
#include "optimize/place_quality.h"
#include "optimize/raise_quality.h"
#include "optimize/seat_excerpt.h"
#include "optimize/stays_near.h"

namespace amhex {
namespace {

// A mesh that is poor all over gains little by each.
constexpr int kMostCells = 6;
// The poorest come first: where so many in a row stay as they are, so does the mesh's minimum.
constexpr int kMostInVain = 2;
// Of the best ways, as many are put in as it takes for one to fit.
constexpr size_t kMostWaysPutIn = 3;

using VertexKey = std::vector<int32_t>;  // what tells a cell again

class Divider {
 public:
  Divider(const CellComplex& complex, const RefillWith& with)
      : with_(with),
        poll_(with.run),
        mesh_(complex, poll_),
        cells_at_(mesh_.CellsAtVertices(poll_)),
        quality_(CellQualities(mesh_, {}, poll_)) {}

  // The poorest one that is not among `tried`; -1: none is poor.
  int PoorestBut(const std::set<VertexKey>& tried) const {
    int poorest = -1;
    for (int cell = 0; cell < mesh_.cell_slots(); ++cell) {
      if (quality_[cell] >= (poorest < 0 ? kPoor : quality_[poorest])) continue;
      if (!tried.contains(KeyOf(cell))) poorest = cell;
    }
    return poorest;
  }
  VertexKey KeyOf(int cell) const {
    const CellVertices vertices = VerticesOf(mesh_.corners(cell));
    VertexKey key(vertices.begin(), vertices.end());
    std::sort(key.begin(), key.end());
    return key;
  }

  // The mesh with this cell's surroundings changed; nothing where no way of doing so is better.
  std::optional<CellComplex> Changed(int cell) const {
    for (const Way& way : WaysAt(cell)) {
      auto raised = way.excerpt.Raised(way.part, with_.features, with_.run);
      if (!raised.has_value()) continue;
      auto whole = way.excerpt.InWhole(mesh_, *raised, poll_);
      if (!whole.has_value()) continue;
      const WorkingMesh changed(*whole, poll_);
      if (NewBoundaryDefects(mesh_, changed, with_.hull, poll_).empty()) return whole;
    }
    return std::nullopt;
  }

 private:
  struct Way {
    SeatExcerpt excerpt;
    CellComplex part;
    double gain = 0;  // of what its cells lack
  };

  // The best ones, best first.
  std::vector<Way> WaysAt(int cell) const {
    const std::vector<Seat> seats = SeatsOf(cell);
    std::vector<std::optional<Way>> found(seats.size());
    oneapi::tbb::parallel_for(size_t{0}, seats.size(), [&](size_t i) {
      if (!with_.run.ShouldStop()) found[i] = Try(seats[i]);
    });
    std::vector<Way> ways;
    for (std::optional<Way>& way : found) {
      if (way.has_value()) ways.push_back(*std::move(way));
    }
    std::stable_sort(ways.begin(), ways.end(),
                     [](const Way& a, const Way& b) { return a.gain > b.gain; });
    if (ways.size() > kMostWaysPutIn) ways.erase(ways.begin() + kMostWaysPutIn, ways.end());
    return ways;
  }

  std::optional<Way> Try(const Seat& seat) const {
    SeatExcerpt excerpt(mesh_, cells_at_, seat);
    auto part = excerpt.Changed(PlaceIn(seat), PlacementEffort::kValid, with_);
    if (!part.has_value()) return std::nullopt;
    const PlaceQuality before = QualityOfPlace(excerpt.before()), after = QualityOfPlace(*part);
    if (!IsBetter(after, before) || !StaysNear(with_.hull, excerpt.before(), *part, poll_)) {
      return std::nullopt;
    }
    return Way{std::move(excerpt), *std::move(part), before.lack - after.lack};
  }

  // Its faces, edges and vertices.
  std::vector<Seat> SeatsOf(int cell) const {
    std::vector<Seat> seats;
    std::set<VertexKey> edges;
    for (const CellFace& face : FacesOf(mesh_.corners(cell))) {
      const VertexKey corners(face.v.begin(), face.v.begin() + face.count);
      seats.push_back({SeatUse::kDivide, CellsWith(face), corners});
      for (size_t j = 0; j < corners.size(); ++j) {
        const int32_t a = corners[j], b = corners[(j + 1) % corners.size()];
        if (!edges.insert({std::min(a, b), std::max(a, b)}).second) continue;
        seats.push_back(SeatInEdge(a, b, mesh_, cells_at_));
      }
    }
    for (const int32_t v : VerticesOf(mesh_.corners(cell))) {
      if (cells_at_[v].size() > kMostCellsRefilled) continue;
      seats.push_back({SeatUse::kRefill, cells_at_[v], {v}});
    }
    return seats;
  }

  std::vector<int> CellsWith(const CellFace& face) const {
    std::vector<int> cells = {mesh_.Owner(face)};
    if (mesh_.Across(face) >= 0) cells.push_back(mesh_.Across(face));
    std::sort(cells.begin(), cells.end());
    return cells;
  }

  // For the new vertex.
  Vec3d PlaceIn(const Seat& seat) const {
    Vec3d middle;
    for (const int32_t v : seat.corners) {
      middle += mesh_.vertices()[v] / static_cast<double>(seat.corners.size());
    }
    return IsOnBoundary(seat) ? with_.hull.queries->Closest(middle).point : middle;
  }
  bool IsOnBoundary(const Seat& seat) const {
    return std::any_of(seat.cells.begin(), seat.cells.end(), [&](int cell) {
      const CellFaces faces = FacesOf(mesh_.corners(cell));
      return std::any_of(faces.begin(), faces.end(), [&](const CellFace& face) {
        return seat.IsIn(face) && mesh_.Across(face) == WorkingMesh::kHull;
      });
    });
  }

  const RefillWith& with_;
  const StopPoll poll_;
  const WorkingMesh mesh_;
  const CellLists cells_at_;
  const std::vector<double> quality_;  // [cell]
};

}  // namespace

absl::StatusOr<CellComplex> DividePoorCells(CellComplex complex, const RefillWith& with) {
  AMHEX_RETURN_IF_ERROR(with.run.CheckStop());
  if (SummarizeQuality(complex, StopPoll(with.run)).minimum >= kPoor) return complex;
  std::set<VertexKey> tried;
  std::optional<Divider> divider;
  int in_vain = 0;
  for (int i = 0; i < kMostCells && in_vain < kMostInVain; ++i) {
    AMHEX_RETURN_IF_ERROR(with.run.CheckStop());
    if (!divider.has_value()) divider.emplace(complex, with);
    const int poorest = divider->PoorestBut(tried);
    if (poorest < 0) break;
    tried.insert(divider->KeyOf(poorest));
    std::optional<CellComplex> changed = divider->Changed(poorest);
    in_vain = changed.has_value() ? 0 : in_vain + 1;
    if (!changed.has_value()) continue;
    complex = *std::move(changed);
    divider.reset();
  }
  AMHEX_RETURN_IF_ERROR(with.run.CheckStop());
  return complex;
}

}  // namespace amhex
