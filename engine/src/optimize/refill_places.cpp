#include "optimize/refill_places.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "closure/boundary_defects.h"
#include "closure/close_complex.h"
#include "closure/excerpt.h"
#include "closure/improve_closure.h"
#include "closure/working_mesh.h"
#include "optimize/cell_quality.h"
#include "optimize/place_vertices.h"

namespace amhex {
namespace {

// Cells below this are poor: their places are opened.
constexpr double kPoor = 0.30;
// What is tried, until no cell is poor any more; the best of it is kept.
enum class Remedy : uint8_t {
  kJoint,   // the cells stay, vertices around the poor ones move together
  kMove,    // the cells stay, all vertices move, one after the other
  kRepair,  // poor cells and some of their neighbours become other stars
  kRefill,  // the stars of the poor cells, and layers of cells around, are taken out and refilled
};
struct Attempt {
  Remedy remedy;
  int layers = 0;
  FirstFilling first = FirstFilling::kStars;
};
constexpr Attempt kAttempts[] = {{Remedy::kJoint},
                                 {Remedy::kMove},
                                 {Remedy::kRepair},
                                 {Remedy::kRefill, 0, FirstFilling::kStars},
                                 {Remedy::kRefill, 0, FirstFilling::kCarving},
                                 {Remedy::kRefill, 1, FirstFilling::kStars}};
// One place can afford a wider search than all the mesh can.
constexpr int kRepairDepth = 8;
constexpr int kRepairBeamWidth = 8;
constexpr double kGoodRepair = 0.35;
constexpr double kPoorRepairCost = 300;  // cells per unit
constexpr int kMostLayers = 1;           // of kAttempts
// Rings of cells around what is opened: vertices of the first may move, the others are there to
// be seen: a corner of the hull finds its vertex up to 1.1 edge lengths away.
constexpr int kMovingRings = 2;
constexpr int kSeenRings = 2;
constexpr size_t kMostCellsOpened = 100;
// Larger openings are not refilled: in 23 meshes no filling of more than 41 cells was taken, and
// one of 90 takes one to two seconds of a core.
constexpr size_t kMostCellsRefilled = 60;
// The places of one wave do not touch. Each place has its turn once.
constexpr int kMostWaves = 12;
// Cells that all places together may open: worst places first, until these are spent. A mesh that
// is poor all over gains little by them.
constexpr double kFreeOpenings = 150;
constexpr double kOpeningsPerCell = 0.02;

// A place is better if what its cells lack to kWanted, squared, falls to this share.
constexpr double kWanted = 0.32;
constexpr double kWorthwhileShare = 0.8;
// New boundary faces and moved vertices may cut off or add this many cells; a part of the solid
// that is lost shows in more.
constexpr double kMaxVolumeChange = 0.5;
constexpr double kHopelessVolumeChange = 2.0;  // before the vertices have moved

PlacementEffort EffortFor(Remedy remedy) {
  switch (remedy) {
    case Remedy::kJoint:
      return PlacementEffort::kJoint;
    case Remedy::kMove:
      return PlacementEffort::kRaise;
    case Remedy::kRepair:
    case Remedy::kRefill:
      break;
  }
  return PlacementEffort::kValid;
}

struct Place {
  double quality = 1;      // of its poorest cell
  std::vector<int> cells;  // poor ones and the stars that they belong to, ascending
};

struct PlaceQuality {
  double minimum = 1;
  double lack = 0;
  double volume = 0;
};

PlaceQuality QualityOf(const CellComplex& complex) {
  PlaceQuality result;
  for (const CellCorners& cell : complex.cells) {
    const double quality = CellQuality(cell, complex.vertices);
    const double lack = std::max(0.0, kWanted - quality);
    result.minimum = std::min(result.minimum, quality);
    result.lack += lack * lack;
    result.volume += CellVolume(cell, complex.vertices);
  }
  return result;
}

using CellLists = std::vector<std::vector<int>>;

// The cells and those that share a vertex with any of them.
std::vector<int> WithRing(const WorkingMesh& mesh, const CellLists& cells_at,
                          const std::vector<int>& cells) {
  std::vector<int> grown;
  for (const int cell : cells) {
    for (const int32_t v : VerticesOf(mesh.corners(cell))) {
      grown.insert(grown.end(), cells_at[v].begin(), cells_at[v].end());
    }
  }
  std::sort(grown.begin(), grown.end());
  grown.erase(std::unique(grown.begin(), grown.end()), grown.end());
  return grown;
}

// The cells and those that share a face with any of them.
std::vector<int> WithLayer(const WorkingMesh& mesh, const std::vector<int>& cells) {
  std::vector<int> grown = cells;
  for (const int cell : cells) {
    for (const int32_t half : mesh.half_faces(cell)) {
      if (half >= 0 && mesh.owner(half ^ 1) >= 0) grown.push_back(mesh.owner(half ^ 1));
    }
  }
  std::sort(grown.begin(), grown.end());
  grown.erase(std::unique(grown.begin(), grown.end()), grown.end());
  return grown;
}

bool IsPointed(PrimitiveType type) {
  return type == PrimitiveType::kPyramid || type == PrimitiveType::kTetrahedron;
}

// Poor cells with the whole of their stars; those that share a face make one place. Worst first.
std::vector<Place> FindPlaces(const WorkingMesh& mesh, const CellLists& cells_at) {
  std::vector<double> quality(mesh.cell_slots(), 1);
  std::vector<uint8_t> is_open(mesh.cell_slots(), 0);
  const auto is_apex = [&](int32_t v) {
    return std::all_of(cells_at[v].begin(), cells_at[v].end(),
                       [&](int cell) { return IsPointed(mesh.type(cell)); });
  };
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (!mesh.alive(cell)) continue;
    quality[cell] = CellQuality(mesh.corners(cell), mesh.vertices());
    if (quality[cell] >= kPoor) continue;
    is_open[cell] = 1;
    for (const int32_t v : VerticesOf(mesh.corners(cell))) {
      if (!is_apex(v)) continue;
      for (const int other : cells_at[v]) is_open[other] = 1;
    }
  }
  std::vector<Place> places;
  for (int seed = 0; seed < mesh.cell_slots(); ++seed) {
    if (!is_open[seed]) continue;
    Place place;
    place.cells = {seed};
    is_open[seed] = 0;
    for (size_t i = 0; i < place.cells.size(); ++i) {
      place.quality = std::min(place.quality, quality[place.cells[i]]);
      for (const int32_t half : mesh.half_faces(place.cells[i])) {
        const int32_t behind = half < 0 ? -1 : mesh.owner(half ^ 1);
        if (behind < 0 || !is_open[behind]) continue;
        is_open[behind] = 0;
        place.cells.push_back(behind);
      }
    }
    std::sort(place.cells.begin(), place.cells.end());
    if (place.cells.size() <= kMostCellsOpened) places.push_back(std::move(place));
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.quality < b.quality; });
  return places;
}

// One place, everything around it that its refilling may look at, and its better version.
class PlaceRefill {
 public:
  PlaceRefill(const WorkingMesh& whole, const CellLists& cells_at, const Place& place)
      : excerpt_(whole, CellsAround(whole, cells_at, place)) {
    std::vector<int> opened = place.cells;
    for (int layers = 0; layers <= kMostLayers; ++layers) {
      if (layers > 0) opened = WithLayer(whole, opened);
      for (const int cell : opened) openings_[layers].push_back(excerpt_.CellOf(cell));
    }
    repair_ = {.quality = kWanted,
               .depth = kRepairDepth,
               .beam_width = kRepairBeamWidth,
               .good_quality = kGoodRepair,
               .poor_quality = kPoorRepairCost,
               .only = openings_[0]};
    std::vector<int> moving = opened;
    for (int ring = 0; ring < kMovingRings; ++ring) moving = WithRing(whole, cells_at, moving);
    fixed_.assign(excerpt_.vertices().size(), 0);
    for (const int cell : excerpt_.cells()) {
      if (std::binary_search(moving.begin(), moving.end(), cell)) continue;
      for (const int32_t v : excerpt_.complex().cells[excerpt_.CellOf(cell)]) fixed_[v] = 1;
    }
  }

  const Excerpt& excerpt() const { return excerpt_; }
  const std::optional<CellComplex>& better() const { return better_; }
  void Discard() { better_.reset(); }

  void Run(const Hull& hull, const HullFeatures& features, const MeshingParams& params,
           const RunContext& run) {
    const PlaceQuality before = QualityOf(excerpt_.complex());
    const CellComplex closed = excerpt_.Closed();
    double least = kWorthwhileShare * before.lack;
    for (const Attempt& attempt : kAttempts) {
      if (run.ShouldStop()) return;
      if (attempt.remedy == Remedy::kRefill &&
          openings_[attempt.layers].size() > kMostCellsRefilled) {
        continue;
      }
      auto changed = Change(closed, attempt, hull, params, run);
      if (!changed.ok() || !excerpt_.TakeBack(&*changed)) continue;
      if (std::abs(QualityOf(*changed).volume - before.volume) > kHopelessVolumeChange) continue;
      auto placed =
          PlacePart(*std::move(changed), fixed_, features, run, EffortFor(attempt.remedy));
      if (!placed.ok()) continue;
      const PlaceQuality after = QualityOf(*placed);
      if (after.minimum < before.minimum || after.lack >= least ||
          std::abs(after.volume - before.volume) > kMaxVolumeChange) {
        continue;
      }
      least = after.lack;
      better_ = *std::move(placed);
      if (after.minimum >= kPoor) break;
    }
    if (!better_.has_value()) return;
    auto raised = PlacePart(*better_, fixed_, features, run, PlacementEffort::kRaise);
    if (raised.ok()) better_ = *std::move(raised);
  }

 private:
  absl::StatusOr<CellComplex> Change(const CellComplex& closed, const Attempt& attempt,
                                     const Hull& hull, const MeshingParams& params,
                                     const RunContext& run) {
    switch (attempt.remedy) {
      case Remedy::kJoint:
      case Remedy::kMove:
        return closed;
      case Remedy::kRepair:
        return RepairCells(closed, hull, repair_, run);
      case Remedy::kRefill:
        break;
    }
    const Opening opening{openings_[attempt.layers], attempt.first};
    if (attempt.first == FirstFilling::kCarving && stars_were_in_vain_) {
      return absl::AlreadyExistsError("the attempt before came to the same");
    }
    AMHEX_ASSIGN_OR_RETURN(Refilled refilled, RefillOpening(closed, hull, opening, params, run));
    stars_were_in_vain_ = refilled.first_was_in_vain;
    return std::move(refilled.complex);
  }

  static std::vector<int> CellsAround(const WorkingMesh& whole, const CellLists& cells_at,
                                      const Place& place) {
    std::vector<int> cells = place.cells;
    for (int layer = 0; layer < kMostLayers; ++layer) cells = WithLayer(whole, cells);
    for (int ring = 0; ring < kMovingRings + kSeenRings; ++ring) {
      cells = WithRing(whole, cells_at, cells);
    }
    return cells;
  }

  Excerpt excerpt_;
  std::vector<int32_t> openings_[kMostLayers + 1];  // by layers, in numbers of the excerpt
  RepairEffort repair_;
  std::vector<uint8_t> fixed_;  // [vertex of the excerpt]
  std::optional<CellComplex> better_;
  bool stars_were_in_vain_ = false;  // in the last opening
};

// What tells a place again after others have changed the mesh: its vertices.
using PlaceKey = std::vector<int32_t>;
PlaceKey KeyOf(const WorkingMesh& mesh, const Place& place) {
  PlaceKey key;
  for (const int cell : place.cells) {
    for (const int32_t v : VerticesOf(mesh.corners(cell))) key.push_back(v);
  }
  std::sort(key.begin(), key.end());
  key.erase(std::unique(key.begin(), key.end()), key.end());
  return key;
}

class Refiller {
 public:
  Refiller(const Hull& hull, const HullFeatures& features, const MeshingParams& params,
           const RunContext& run)
      : hull_(hull), features_(features), params_(params), run_(run) {}

  void PermitOpenings(double cells) { openings_left_ = cells; }

  // Refills places that do not touch and have not had their turn; false if there are none.
  absl::StatusOr<bool> RunWave(CellComplex* complex) {
    AMHEX_RETURN_IF_ERROR(run_.CheckStop());
    const WorkingMesh whole(*complex, StopPoll(run_));
    const CellLists cells_at = whole.CellsAtVertices(StopPoll(run_));
    std::vector<PlaceRefill> wave;
    std::vector<uint8_t> is_taken(whole.cell_slots(), 0);
    for (const Place& place : FindPlaces(whole, cells_at)) {
      if (openings_left_ <= 0) break;
      PlaceKey key = KeyOf(whole, place);
      if (tried_.contains(key)) continue;
      PlaceRefill refill(whole, cells_at, place);
      const std::vector<int>& cells = refill.excerpt().cells();
      if (std::any_of(cells.begin(), cells.end(), [&](int c) { return is_taken[c] != 0; })) {
        continue;
      }
      for (const int cell : cells) is_taken[cell] = 1;
      tried_.insert(std::move(key));
      openings_left_ -= static_cast<double>(place.cells.size());
      wave.push_back(std::move(refill));
    }
    oneapi::tbb::parallel_for(size_t{0}, wave.size(),
                              [&](size_t i) { wave[i].Run(hull_, features_, params_, run_); });
    if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
    Apply(whole, &wave, complex);
    return !wave.empty();
  }

 private:
  // Puts in what is better. Where the boundary then touches or crosses itself, what was there
  // stays.
  void Apply(const WorkingMesh& whole, std::vector<PlaceRefill>* wave, CellComplex* complex) {
    while (std::any_of(wave->begin(), wave->end(),
                       [](const PlaceRefill& refill) { return refill.better().has_value(); })) {
      WorkingMesh changed = whole;
      bool fits = true;
      for (PlaceRefill& refill : *wave) {
        if (!refill.better().has_value()) continue;
        if (refill.excerpt().PutInto(*refill.better(), &changed)) continue;
        refill.Discard();
        fits = false;
        break;
      }
      if (!fits) continue;
      const std::vector<int32_t> defects = FindBoundaryDefects(changed, hull_, StopPoll(run_));
      if (defects.empty()) {
        *complex = changed.ToComplex(StopPoll(run_));
        return;
      }
      DiscardAt(defects, static_cast<int32_t>(whole.vertices().size()), wave);
    }
  }

  // All of them if none is at a defect.
  static void DiscardAt(const std::vector<int32_t>& defects, int32_t first_new_vertex,
                        std::vector<PlaceRefill>* wave) {
    bool any = false;
    const bool has_new = defects.back() >= first_new_vertex;
    for (PlaceRefill& refill : *wave) {
      if (!refill.better().has_value()) continue;
      const std::vector<int32_t>& own = refill.excerpt().vertices();
      const bool is_at = std::any_of(defects.begin(), defects.end(), [&](int32_t v) {
        return std::binary_search(own.begin(), own.end(), v);
      });
      if (!is_at && !has_new) continue;
      refill.Discard();
      any = true;
    }
    if (any) return;
    for (PlaceRefill& refill : *wave) refill.Discard();
  }

  const Hull& hull_;
  const HullFeatures& features_;
  const MeshingParams& params_;
  const RunContext& run_;
  std::set<PlaceKey> tried_;
  double openings_left_ = 0;
};

}  // namespace

absl::StatusOr<CellComplex> RefillPlaces(const CellComplex& complex, const Hull& hull,
                                         const HullFeatures& features, const MeshingParams& params,
                                         const RunContext& run) {
  CellComplex result = complex;
  Refiller refiller(hull, features, params, run);
  refiller.PermitOpenings(kFreeOpenings +
                          kOpeningsPerCell * static_cast<double>(complex.cells.size()));
  for (int wave = 0; wave < kMostWaves; ++wave) {
    AMHEX_ASSIGN_OR_RETURN(const bool any, refiller.RunWave(&result));
    if (!any) break;
  }
  return result;
}

}  // namespace amhex
