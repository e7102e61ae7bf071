#include "optimize/refill_places.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "closure/boundary_defects.h"
#include "closure/cell_qualities.h"
#include "closure/working_mesh.h"
#include "optimize/place_refill.h"

namespace amhex {
namespace {

constexpr size_t kMostCellsOpened = 100;
// The places of one wave do not touch. Each place has its turn once.
constexpr int kMostWaves = 12;
// Cells that all places together may open: worst places first, until these are spent. A mesh that
// is poor all over gains little by them.
constexpr double kFreeOpenings = 150;
constexpr double kOpeningsPerCell = 0.02;

bool IsPointed(PrimitiveType type) {
  return type == PrimitiveType::kPyramid || type == PrimitiveType::kTetrahedron;
}

// Those of `is_open` that share a face make one place, if they are few enough; those of places that
// are too large to be refilled are `large`.
std::vector<Place> Connected(const WorkingMesh& mesh, const std::vector<double>& quality,
                             std::vector<uint8_t> is_open, std::vector<int>* large) {
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
    if (place.cells.size() > kMostCellsRefilled) {
      large->insert(large->end(), place.cells.begin(), place.cells.end());
    }
    if (place.cells.size() <= kMostCellsOpened) places.push_back(std::move(place));
  }
  return places;
}

// Poor cells with the whole of their stars, and without them where these are too many to be
// refilled. Worst first.
std::vector<Place> FindPlaces(const WorkingMesh& mesh, const CellLists& cells_at,
                              const StopPoll& poll) {
  const std::vector<double> quality = CellQualities(mesh, {}, poll);
  std::vector<uint8_t> is_open(mesh.cell_slots(), 0);
  const auto is_apex = [&](int32_t v) {
    return std::all_of(cells_at[v].begin(), cells_at[v].end(),
                       [&](int cell) { return IsPointed(mesh.type(cell)); });
  };
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (quality[cell] >= kPoor) continue;
    is_open[cell] = 1;
    for (const int32_t v : VerticesOf(mesh.corners(cell))) {
      if (!is_apex(v)) continue;
      for (const int other : cells_at[v]) is_open[other] = 1;
    }
  }
  std::vector<int> large;
  std::vector<Place> places = Connected(mesh, quality, std::move(is_open), &large);
  is_open.assign(mesh.cell_slots(), 0);
  for (const int cell : large) is_open[cell] = quality[cell] < kPoor;
  for (Place& place : Connected(mesh, quality, std::move(is_open), &large)) {
    places.push_back(std::move(place));
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.quality < b.quality; });
  return places;
}

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
    for (const Place& place : FindPlaces(whole, cells_at, StopPoll(run_))) {
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
    const TryOrder order = OrderFor(wave.size());
    oneapi::tbb::parallel_for(size_t{0}, wave.size(), [&](size_t i) {
      wave[i].Run({hull_, features_, params_, run_}, order);
    });
    if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
    Apply(whole, &wave, complex);
    return !wave.empty();
  }

 private:
  // Ahead where there are fewer places than threads: what is in vain then costs no time.
  static TryOrder OrderFor(size_t places) {
    using oneapi::tbb::global_control;
    const size_t threads = global_control::active_value(global_control::max_allowed_parallelism);
    return places < threads ? TryOrder::kAhead : TryOrder::kInTurn;
  }

  // Vertices of a mesh by their numbers, from `begin` to `end`.
  struct VertexRange {
    int32_t begin = 0, end = 0;
    bool Has(int32_t v) const { return begin <= v && v < end; }
  };

  // Puts in what is better. Where the boundary then touches or crosses itself and has not done so
  // before, what was there stays.
  void Apply(const WorkingMesh& whole, std::vector<PlaceRefill>* wave, CellComplex* complex) {
    while (std::any_of(wave->begin(), wave->end(),
                       [](const PlaceRefill& refill) { return refill.better().has_value(); })) {
      WorkingMesh changed = whole;
      std::vector<VertexRange> added(wave->size());
      bool fits = true;
      for (size_t i = 0; i < wave->size() && fits; ++i) {
        PlaceRefill& refill = (*wave)[i];
        if (!refill.better().has_value()) continue;
        added[i].begin = VertexCount(changed);
        fits = refill.excerpt().PutInto(*refill.better(), &changed);
        added[i].end = VertexCount(changed);
        if (!fits) refill.Discard();
      }
      if (!fits) continue;
      const std::vector<int32_t> defects =
          NewBoundaryDefects(whole, changed, hull_, StopPoll(run_));
      if (defects.empty()) {
        *complex = changed.ToComplex(StopPoll(run_));
        return;
      }
      DiscardAt(defects, added, wave);
    }
  }

  static int32_t VertexCount(const WorkingMesh& mesh) {
    return static_cast<int32_t>(mesh.vertices().size());
  }

  // All of them if none is at a defect.
  static void DiscardAt(const std::vector<int32_t>& defects, const std::vector<VertexRange>& added,
                        std::vector<PlaceRefill>* wave) {
    bool any = false;
    for (size_t i = 0; i < wave->size(); ++i) {
      PlaceRefill& refill = (*wave)[i];
      if (!refill.better().has_value()) continue;
      const std::vector<int32_t>& own = refill.excerpt().vertices();
      const bool is_at = std::any_of(defects.begin(), defects.end(), [&](int32_t v) {
        return added[i].Has(v) || std::binary_search(own.begin(), own.end(), v);
      });
      if (!is_at) continue;
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
