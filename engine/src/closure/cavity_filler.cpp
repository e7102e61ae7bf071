#include "closure/cavity_filler.h"

#include <algorithm>
#include <numeric>

#include "closure/delaunay_fill.h"
#include "closure/prepare_cavities.h"
#include "closure/star_fill.h"
#include "geometry/point_bins.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// What no single star fills costs more and more cells per open face, step by step.
struct FillStep {
  CarveLimits carving;
  int max_cells_per_face;  // of a Delaunay filling around one cavity; 0: none
};
constexpr FillStep kFillSteps[] = {{{0.15, 4.0, 4}, 0}, {{0.03, 14.0, 7}, 8}};
// Carving ends after so many parts looked at, and so many per cell that the solid holds, some 5 ms
// of one core; a solid that its cells fit needs a tenth of that.
constexpr int64_t kCarvedParts = 50'000;
constexpr double kCarvedPartsPerCell = 400;
// What is opened again later may cost as much, and so much per open face: of 56 refilled places,
// the better ones took at most 520 parts per open face, but for one of 1,100.
constexpr int64_t kPartsOfOpening = 10'000;
constexpr int64_t kPartsPerOpenedFace = 900;
constexpr int kAnyNumber = 1 << 20;
constexpr StarRound kDeepRound = {12, 10, 40};
// After that all cells this near to what resists (edge lengths; none but hexahedra are left that
// are by kOthersReach farther away) are given up at once: layers are of small cells by then.
constexpr double kClearedReaches[] = {0.5, 0.75, 1.0, 1.25, 0.6, 0.85, 1.1};
constexpr double kOthersReach = 0.75;
// Where this much of the volume stays away (edge lengths cubed) it was not filled.
constexpr double kMostClearedVolume = 2.0;
// What one of these may cost in carving, per face that it opens.
constexpr int64_t kPartsPerClearedFace = 2000;
// And all of them together: so many times what carving may cost; less where the mesh is opened
// again later.
constexpr int64_t kClearings = 4;
constexpr int64_t kPartsToClearWhenMending = 500'000;
// Only then, and first around each cavity, later over the whole mesh, is it filled by Delaunay.
constexpr int kWholeMeshAttempt = 2;
// Each attempt of the last resort removes one more layer of cells around what resisted.
constexpr int kDelaunayAttempts = 6;

}  // namespace

double VolumeOf(const WorkingMesh& mesh) {
  double volume = 0;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (mesh.alive(cell)) volume += CellVolume(mesh.corners(cell), mesh.vertices());
  }
  return volume;
}

CavityFiller::CavityFiller(const CellComplex& complex, const Hull& hull, uint64_t seed,
                           const RunContext& run)
    : hull_(hull),
      seed_(seed),
      run_(run),
      mesh_(complex, StopPoll(run)),
      most_carved_parts_(kCarvedParts + static_cast<int64_t>(hull.volume * kCarvedPartsPerCell)),
      parts_to_clear_(kClearings * most_carved_parts_) {}

void CavityFiller::Watch(RunContext* watched) {
  watched_ = watched;
  first_open_ = std::max<size_t>(1, mesh_.OpenFaces().size());
}

int64_t CavityFiller::PartsOfOpening() const {
  return kPartsOfOpening + kPartsPerOpenedFace * static_cast<int64_t>(mesh_.OpenFaces().size());
}

void CavityFiller::CarveAtLeastForOpening() {
  most_carved_parts_ = std::max(most_carved_parts_, carved_parts_ + PartsOfOpening());
}

void CavityFiller::CarveAtMostForOpening() {
  carved_parts_ = 0;
  most_carved_parts_ = std::min(most_carved_parts_, PartsOfOpening());
}

void CavityFiller::ClearLess() {
  parts_to_clear_ = std::min(parts_to_clear_, kPartsToClearWhenMending);
}

void CavityFiller::GoBackTo(State state) {
  mesh_ = std::move(state.mesh);
  tried_ = std::move(state.tried);
}

void CavityFiller::FillByStars(int round, int attempts) {
  for (int attempt = 0; attempt < kFillAttempts && HasOpenFaces(); ++attempt) {
    if (run_.ShouldStop()) return;
    if (attempt >= attempts && carved_parts_ >= most_carved_parts_) return;
    if (attempt > 0) {
      RemoveCellsAtCavities();
      RemoveLooseCells(&mesh_);
      for (const StarRound& star_round : kSlitRounds) FillWithStars(star_round);
    }
    const auto salt =
        uint64_t{kFillAttempts} * static_cast<uint64_t>(round) + static_cast<uint64_t>(attempt);
    TakeFillSteps(seed_ + salt);
  }
}

void CavityFiller::TakeFillSteps(uint64_t seed) {
  for (const FillStep& step : kFillSteps) {
    CarveNetworks(step.carving);
    FillWithStars(kFirstRounds[1]);
    DeclareHullFaces(hull_, &mesh_);
    if (step.max_cells_per_face > 0) FillLocally(seed, step.max_cells_per_face);
  }
  FillWithStars(kDeepRound);
}

void CavityFiller::ClearAndFill() {
  const int64_t carved_parts = carved_parts_, most_carved_parts = most_carved_parts_;
  for (const double reach : kClearedReaches) {
    if (!HasOpenFaces() || run_.ShouldStop() || parts_to_clear_ <= 0) break;
    State before = Save();
    const size_t open_before = mesh_.OpenFaces().size();
    ClearAround(reach);
    RemoveLooseCells(&mesh_);
    DeclareHullFaces(hull_, &mesh_);
    carved_parts_ = 0;
    most_carved_parts_ = kPartsPerClearedFace * static_cast<int64_t>(mesh_.OpenFaces().size());
    for (const StarRound& star_round : kSlitRounds) FillWithStars(star_round);
    TakeFillSteps(seed_);
    parts_to_clear_ -= carved_parts_;
    if (mesh_.OpenFaces().size() >= open_before ||
        VolumeOf(mesh_) < VolumeOf(before.mesh) - kMostClearedVolume) {
      GoBackTo(std::move(before));
    }
  }
  carved_parts_ = carved_parts;
  most_carved_parts_ = most_carved_parts;
}

void CavityFiller::ClearAround(double reach) {
  std::vector<Vec3d> open;
  for (const CellFace& face : mesh_.OpenFaces()) {
    open.push_back(FaceCentroid(face, mesh_.vertices()));
  }
  const PointBins bins(open, 1.0);
  for (int cell = 0; cell < mesh_.cell_slots(); ++cell) {
    if (!mesh_.alive(cell)) continue;
    bool is_near = false;
    bins.ForEachWithin(CellCentroid(mesh_.corners(cell), mesh_.vertices()),
                       reach + (mesh_.is_hexahedron(cell) ? 0 : kOthersReach),
                       [&](int) { is_near = true; });
    if (is_near) mesh_.RemoveCell(cell);
  }
}

void CavityFiller::FillByTetrahedra(int round) {
  for (int attempt = 0; attempt < kDelaunayAttempts && HasOpenFaces(); ++attempt) {
    if (run_.ShouldStop()) return;
    for (int layer = 0; layer < attempt; ++layer) RemoveCellsAtCavities();
    const auto salt =
        uint64_t{kDelaunayAttempts} * static_cast<uint64_t>(round) + static_cast<uint64_t>(attempt);
    FillLocally(seed_ + salt, kAnyNumber);
    if (attempt < kWholeMeshAttempt) continue;
    const Cavities cavities = CollectCavities(mesh_);
    FillByDelaunay(hull_, cavities, ScopeOfWholeMesh(mesh_, cavities), seed_ + salt, &mesh_);
    for (const StarRound& star_round : kSlitRounds) FillWithStars(star_round);
  }
}

// Stars over parts of what no single star fills, until no part is worth it.
void CavityFiller::CarveNetworks(const CarveLimits& limits) {
  CarveMemory memory;
  memory.part_count = carved_parts_;
  memory.most_parts = most_carved_parts_;
  while (HasOpenFaces() && CarveCavities(hull_, limits, run_, &memory, &mesh_) > 0) {
    FillWithStars(kFirstRounds[1]);
  }
  carved_parts_ = memory.part_count;
}

// Each cavity on its own, in the metric of the cells around it, which spares most of them.
void CavityFiller::FillLocally(uint64_t seed, int max_cells_per_face) {
  Cavities cavities = CollectCavities(mesh_);
  CellBins bins(mesh_);
  std::vector<CellFace> places;
  for (const auto& faces : cavities.faces) places.push_back(faces.front());
  for (const CellFace& place : places) {
    if (run_.ShouldStop()) return;
    const int cavity = cavities.Of(mesh_.FindHalfFace(place));
    if (cavity < 0) continue;  // filled along with another
    FillScope scope = ScopeAroundCavity(mesh_, bins, cavities, cavity);
    scope.max_added_cells =
        static_cast<int64_t>(cavities.faces[cavity].size()) * max_cells_per_face;
    if (!FillByDelaunay(hull_, cavities, scope, seed, &mesh_)) continue;
    cavities = CollectCavities(mesh_);
    bins.AddNewCells(mesh_);
  }
  for (const StarRound& star_round : kSlitRounds) FillWithStars(star_round);
}

bool CavityFiller::FillWithStars(const StarRound& round) {
  Cavities cavities = CollectCavities(mesh_);
  std::vector<int> order(cavities.count());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return cavities.faces[a].size() < cavities.faces[b].size();
  });
  GrowthLimits limits;
  limits.depth = round.depth;
  limits.beam_width = round.beam_width;
  limits.run = &run_;
  bool any = false;
  for (const int cavity : order) {
    if (run_.ShouldStop()) return any;
    const size_t size = cavities.faces[cavity].size();
    if (size == 0 || size > round.max_cavity_faces) continue;
    if (!tried_.insert(AttemptAt(cavities.faces[cavity], round)).second) continue;
    Region seed;
    seed.cavities = {cavity};
    const auto filling = GrowStar(mesh_, hull_, cavities, {}, limits, {seed}, 1e8);
    if (!filling) continue;
    ApplyStar(*filling, &mesh_);
    any = true;
    for (const int filled : filling->region.cavities) {
      for (const CellFace& face : cavities.faces[filled]) {
        cavities.of_half_face[mesh_.FindHalfFace(face)] = -1;
      }
      cavities.faces[filled].clear();
    }
  }
  ReportProgress();
  return any;
}

CavityFiller::Attempt CavityFiller::AttemptAt(const std::vector<CellFace>& faces,
                                              const StarRound& round) const {
  Attempt attempt{round.depth, {}};
  for (const CellFace& face : faces) attempt.second.push_back(mesh_.FindHalfFace(face));
  return attempt;
}

void CavityFiller::RemoveCellsAtCavities() {
  for (const CellFace& face : mesh_.OpenFaces()) {
    const int32_t cell = mesh_.Owner(face);
    if (cell >= 0) mesh_.RemoveCell(cell);
  }
}

void CavityFiller::ReportProgress() {
  if (watched_ == nullptr) return;
  Progress progress = watched_->progress();
  progress.stage_fraction =
      1.0 - static_cast<double>(mesh_.OpenFaces().size()) / static_cast<double>(first_open_);
  progress.stage_fraction = std::clamp(progress.stage_fraction, 0.0, 0.99);
  progress.cell_count = 0;
  progress.cells_by_type = {};
  for (int cell = 0; cell < mesh_.cell_slots(); ++cell) {
    if (!mesh_.alive(cell)) continue;
    ++progress.cell_count;
    ++progress.cells_by_type[static_cast<size_t>(mesh_.type(cell))];
  }
  watched_->Report(progress);
}

}  // namespace amhex
