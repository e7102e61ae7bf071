#include "closure/close_complex.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <set>
#include <string>

#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "closure/boundary_defects.h"
#include "closure/carve.h"
#include "closure/cavities.h"
#include "closure/delaunay_fill.h"
#include "closure/extrude_layer.h"
#include "closure/fill_wedges.h"
#include "closure/prepare_cavities.h"
#include "closure/star_fill.h"
#include "geometry/point_bins.h"
#include "optimize/cell_quality.h"
#include "optimize/report_cells.h"

namespace amhex {
namespace {

// How far stars may grow, by round.
struct StarRound {
  int depth;
  int beam_width;
  size_t max_cavity_faces;
};
constexpr StarRound kFirstRounds[] = {{6, 4, 60}, {9, 6, 100}};
constexpr StarRound kSlitRounds[] = {{4, 4, 40}, {7, 6, 80}};
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
// Stars and carvings are tried this often, each time with the cells around what resists removed.
constexpr int kFillAttempts = 4;
// Then all cells this near to what resists (edge lengths; none but hexahedra are left that are by
// kOthersReach farther away) are given up at once: layers are of small cells by then.
constexpr double kClearedReaches[] = {0.5, 0.75, 1.0, 1.25, 0.6, 0.85, 1.1};
constexpr double kOthersReach = 0.75;
// Where this much of the volume stays away (edge lengths cubed) it was not filled.
constexpr double kMostClearedVolume = 2.0;
// What one of these may cost in carving, per face that it opens.
constexpr int64_t kPartsPerClearedFace = 2000;
// And all of them together, where the mesh is opened again later.
constexpr int64_t kPartsToClearWhenMending = 500'000;
// Boundary defects nearer to each other (edge lengths) are one place.
constexpr double kPlaceReach = 3.0;
// Only then, and first around each cavity, later over the whole mesh, is it filled by Delaunay.
constexpr int kWholeMeshAttempt = 2;
// Each attempt of the last resort removes one more layer of cells around what resisted.
constexpr int kDelaunayAttempts = 6;
// Boundary defects are opened and filled anew, each time that they come again a layer farther.
constexpr int kDefectAttempts = 6;
// Rounds of refilling have seeds of their own, beyond those of closing.
constexpr int kRefillRound = 2 * kDefectAttempts;
// Seeds of one attempt are counted up from its own base.
constexpr uint64_t kSeedStride = 1000;

double VolumeOf(const WorkingMesh& mesh) {
  double volume = 0;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (mesh.alive(cell)) volume += CellVolume(mesh.corners(cell), mesh.vertices());
  }
  return volume;
}

class Closer {
 public:
  Closer(const CellComplex& complex, const Hull& hull, uint64_t seed, const RunContext& run)
      : hull_(hull),
        seed_(seed),
        run_(run),
        mesh_(complex, StopPoll(run)),
        most_carved_parts_(kCarvedParts + static_cast<int64_t>(hull.volume * kCarvedPartsPerCell)),
        parts_to_clear_(4 * most_carved_parts_) {}

  // `watched`, if any, is told of progress.
  absl::StatusOr<CellComplex> Run(int layers, RunContext* watched) {
    watched_ = watched;
    RemoveLooseCells(&mesh_);
    SnapFacesToHull(hull_, &mesh_);
    ExtrudeToHull(hull_, &mesh_);
    FillWedges(hull_, &mesh_, StopPoll(run_));
    for (int layer = 0; layer < layers; ++layer) RemoveCellsAtCavities();
    prefers_tetrahedra_ = layers > 0;
    first_open_ = std::max<size_t>(1, mesh_.OpenFaces().size());
    for (const StarRound& round : kFirstRounds) {
      FillWithStars(round);
      RemoveLooseCells(&mesh_);
    }
    FillByStars(0);
    ClearAndFill();
    FillByTetrahedra(0);
    std::optional<WorkingMesh> with_far_faces;
    for (int attempt = 1; attempt <= kDefectAttempts && !HasOpenFaces(); ++attempt) {
      if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
      const BoundaryDefects defects = FindBoundaryDefects(mesh_, hull_, StopPoll(run_));
      if (defects.vertices.empty()) break;
      if (!with_far_faces.has_value() && defects.are_just_far) with_far_faces = mesh_;
      FillOpened(defects.vertices, 0, attempt);
    }
    if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
    if (with_far_faces.has_value() && IsNoBetterThan(*with_far_faces)) {
      mesh_ = *std::move(with_far_faces);
    }
    // What is left of defects is for the validator to judge.
    if (HasOpenFaces()) return OpenError();
    CellComplex closed = mesh_.ToComplex(StopPoll(run_));
    // What resists is removed with the cells around it: nothing open does not mean that anything is
    // left.
    if (closed.cells.empty() && !hull_.triangles.empty()) {
      return absl::InternalError(
          "no valid mesh was found: every cell was given up to close a cavity; try another cell "
          "count");
    }
    if (watched != nullptr) ReportCells(closed, *watched);
    return closed;
  }

  absl::StatusOr<Mended> Mend(int layers) {
    const BoundaryDefects defects = FindBoundaryDefects(mesh_, hull_, StopPoll(run_));
    std::optional<WorkingMesh> with_far_faces;
    if (defects.are_just_far) with_far_faces = mesh_;
    Mended mended;
    if (!defects.vertices.empty()) {
      parts_to_clear_ = std::min(parts_to_clear_, kPartsToClearWhenMending);
      mended.changed = FillOpened(defects.vertices, layers, kDefectAttempts + 1 + layers);
      mended.resists = !mended.changed && !defects.are_just_far;
    }
    if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
    if (with_far_faces.has_value() && IsNoBetterThan(*with_far_faces)) {
      mended.changed = false;
      mesh_ = *std::move(with_far_faces);
    }
    if (HasOpenFaces()) return OpenError();
    mended.complex = mesh_.ToComplex(StopPoll(run_));
    return mended;
  }

  absl::StatusOr<Refilled> Refill(const Opening& opening) {
    for (const int32_t cell : opening.cells) mesh_.RemoveCell(cell);
    LimitCarving();
    Refilled refilled;
    if (opening.first == FirstFilling::kStars) {
      refilled.first_was_in_vain = true;
      for (const StarRound& round : kFirstRounds) {
        if (FillWithStars(round)) refilled.first_was_in_vain = false;
      }
    }
    const int round = kRefillRound + static_cast<int>(opening.first);
    FillByStars(round, kFillAttempts);
    FillByTetrahedra(round);
    if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
    if (HasOpenFaces()) return OpenError();
    refilled.complex = mesh_.ToComplex(StopPoll(run_));
    return refilled;
  }

 private:
  // A cavity that a star round has failed to fill is not tried again before it has changed.
  using Attempt = std::pair<int, std::vector<int>>;

  bool HasOpenFaces() const { return mesh_.HasOpenFaces(); }

  // No more than `attempts` once carving has cost what it may: without it, layers around large
  // cavities are given up for nothing.
  void FillByStars(int round, int attempts = 1) {
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

  void TakeFillSteps(uint64_t seed) {
    for (const FillStep& step : kFillSteps) {
      CarveNetworks(step.carving);
      FillWithStars(kFirstRounds[1]);
      DeclareHullFaces(hull_, &mesh_);
      if (step.max_cells_per_face > 0) FillLocally(seed, step.max_cells_per_face);
    }
    FillWithStars(kDeepRound);
  }

  // Every reach starts from the same mesh, until one leaves less open than there was.
  void ClearAndFill() {
    const int64_t carved_parts = carved_parts_, most_carved_parts = most_carved_parts_;
    for (const double reach : kClearedReaches) {
      if (!HasOpenFaces() || run_.ShouldStop() || parts_to_clear_ <= 0) break;
      Filled before = State();
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

  void ClearAround(double reach) {
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

  // Opens the mesh at these and fills it again, at each place on its own where that fails as a
  // whole; where it fails, too, the mesh is as before: filled by tetrahedra over all of it, it
  // would hardly have a hexahedron left. So it is where no other filling was valid, though. False
  // if nothing has changed.
  bool FillOpened(const std::vector<int32_t>& defects, int layers, int round) {
    size_t left = defects.size();
    if (TryOpened(defects, layers, round, &left)) return true;
    bool any = false;
    const std::vector<std::vector<int32_t>> places = PlacesOf(defects);
    for (const std::vector<int32_t>& place : places) {
      if (places.size() == 1 || run_.ShouldStop()) break;
      if (TryOpened(place, layers, round, &left)) any = true;
    }
    return any;
  }

  // Where stars do not fill what was opened, only what leaves fewer than `left` vertices at defects
  // is kept; sets that.
  bool TryOpened(const std::vector<int32_t>& defects, int layers, int round, size_t* left) {
    Filled before = State();
    OpenAt(defects, layers);
    if (round > kDefectAttempts) {
      carved_parts_ = 0;
      LimitCarving();
    } else {
      most_carved_parts_ = std::max(most_carved_parts_, carved_parts_ + PartsOfOpening());
    }
    FillByStars(round);
    if (!HasOpenFaces()) return true;
    ClearAndFill();
    if (HasFewerDefects(left)) return true;
    if (prefers_tetrahedra_) {
      FillByTetrahedra(round);
      return true;
    }
    GoBackTo(std::move(before));
    return false;
  }

  bool HasFewerDefects(size_t* left) const {
    if (HasOpenFaces()) return false;
    const BoundaryDefects defects = FindBoundaryDefects(mesh_, hull_, StopPoll(run_));
    if (defects.vertices.size() >= *left) return false;
    *left = defects.vertices.size();
    return true;
  }

  // Those that are near each other, by way of others.
  std::vector<std::vector<int32_t>> PlacesOf(const std::vector<int32_t>& vertices) const {
    std::vector<Vec3d> points;
    for (const int32_t v : vertices) points.push_back(mesh_.vertices()[v]);
    const PointBins bins(points, kPlaceReach);
    std::vector<std::vector<int32_t>> places;
    std::vector<uint8_t> is_placed(points.size(), 0);
    std::vector<size_t> pending;
    for (size_t first = 0; first < points.size(); ++first) {
      if (is_placed[first]) continue;
      places.emplace_back();
      is_placed[first] = 1;
      pending.push_back(first);
      while (!pending.empty()) {
        const size_t next = pending.back();
        pending.pop_back();
        places.back().push_back(vertices[next]);
        bins.ForEachWithin(points[next], kPlaceReach, [&](int i) {
          if (is_placed[i]) return;
          is_placed[i] = 1;
          pending.push_back(static_cast<size_t>(i));
        });
      }
      std::sort(places.back().begin(), places.back().end());
    }
    return places;
  }

  // A mesh, and which of its cavities have been tried.
  struct Filled {
    WorkingMesh mesh;
    std::set<Attempt> tried;
  };
  Filled State() const { return {mesh_, tried_}; }
  void GoBackTo(Filled state) {
    mesh_ = std::move(state.mesh);
    tried_ = std::move(state.tried);
  }

  void FillByTetrahedra(int round) {
    for (int attempt = 0; attempt < kDelaunayAttempts && HasOpenFaces(); ++attempt) {
      if (run_.ShouldStop()) return;
      for (int layer = 0; layer < attempt; ++layer) RemoveCellsAtCavities();
      const auto salt = uint64_t{kDelaunayAttempts} * static_cast<uint64_t>(round) +
                        static_cast<uint64_t>(attempt);
      FillLocally(seed_ + salt, kAnyNumber);
      if (attempt < kWholeMeshAttempt) continue;
      const Cavities cavities = CollectCavities(mesh_);
      FillByDelaunay(hull_, cavities, ScopeOfWholeMesh(mesh_, cavities), seed_ + salt, &mesh_);
      for (const StarRound& star_round : kSlitRounds) FillWithStars(star_round);
    }
  }

  // Stars over parts of what no single star fills, until no part is worth it.
  void CarveNetworks(const CarveLimits& limits) {
    CarveMemory memory;
    memory.part_count = carved_parts_;
    memory.most_parts = most_carved_parts_;
    while (HasOpenFaces() && CarveCavities(hull_, limits, run_, &memory, &mesh_) > 0) {
      FillWithStars(kFirstRounds[1]);
    }
    carved_parts_ = memory.part_count;
  }

  // Each cavity on its own, in the metric of the cells around it, which spares most of them.
  void FillLocally(uint64_t seed, int max_cells_per_face) {
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

  // What is merely far from the hull may be closed better once it is opened, or in vain, or by
  // giving up what was far away.
  bool IsNoBetterThan(const WorkingMesh& with_far_faces) const {
    return HasOpenFaces() || !FindBoundaryDefects(mesh_, hull_, StopPoll(run_)).vertices.empty() ||
           VolumeOf(mesh_) < VolumeOf(with_far_faces);
  }

  // Opens the mesh around boundary defects, `layers` cells farther than their own, and one more for
  // each time that their place was opened before.
  void OpenAt(const std::vector<int32_t>& defects, int layers) {
    times_opened_.resize(mesh_.vertices().size(), 0);
    const auto layers_at = [&](int32_t v) { return layers + times_opened_[v]; };
    const auto cells_at = mesh_.CellsAtVertices(StopPoll(run_));
    int farthest = 0;
    for (const int32_t v : defects) farthest = std::max(farthest, layers_at(v));
    std::vector<int32_t> opened;
    for (int layer = farthest; layer >= 0; --layer) {
      for (const int32_t v : defects) {
        if (layers_at(v) != layer) continue;
        for (const int cell : cells_at[v]) {
          if (!mesh_.alive(cell)) continue;
          for (const int32_t corner : VerticesOf(mesh_.corners(cell))) opened.push_back(corner);
          mesh_.RemoveCell(cell);
        }
      }
      if (layer > 0) RemoveCellsAtCavities();
    }
    std::sort(opened.begin(), opened.end());
    opened.erase(std::unique(opened.begin(), opened.end()), opened.end());
    for (const int32_t v : opened) ++times_opened_[v];
    for (const StarRound& round : kSlitRounds) FillWithStars(round);
  }

  int64_t PartsOfOpening() const {
    return kPartsOfOpening + kPartsPerOpenedFace * static_cast<int64_t>(mesh_.OpenFaces().size());
  }
  void LimitCarving() { most_carved_parts_ = std::min(most_carved_parts_, PartsOfOpening()); }

  // Tries every cavity once, smallest first; true if any was filled.
  bool FillWithStars(const StarRound& round) {
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

  Attempt AttemptAt(const std::vector<CellFace>& faces, const StarRound& round) const {
    Attempt attempt{round.depth, {}};
    for (const CellFace& face : faces) attempt.second.push_back(mesh_.FindHalfFace(face));
    return attempt;
  }

  void RemoveCellsAtCavities() {
    for (const CellFace& face : mesh_.OpenFaces()) {
      const int32_t cell = mesh_.Owner(face);
      if (cell >= 0) mesh_.RemoveCell(cell);
    }
  }

  void ReportProgress() {
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

  absl::Status OpenError() const {
    const auto open = mesh_.OpenFaces();
    const Vec3d place = hull_.frame.ToUser(FaceCentroid(open.front(), mesh_.vertices()));
    return absl::InternalError(absl::StrFormat(
        "no valid mesh was found: %d faces stay open, the first near (%g, %g, %g); try another "
        "cell count",
        open.size(), place.x, place.y, place.z));
  }

  const Hull& hull_;
  const uint64_t seed_;
  const RunContext& run_;
  RunContext* watched_ = nullptr;
  WorkingMesh mesh_;
  std::set<Attempt> tried_;
  std::vector<int> times_opened_;  // [vertex] as one of a cell at a defect
  int64_t carved_parts_ = 0;
  int64_t most_carved_parts_;
  int64_t parts_to_clear_;  // what carving may still cost where all around is given up first
  bool prefers_tetrahedra_ = false;  // to boundary defects
  size_t first_open_ = 1;
};

}  // namespace

absl::StatusOr<CellComplex> CloseComplex(const CellComplex& complex, const Hull& hull,
                                         const MeshingParams& params, RunContext& run,
                                         int attempt) {
  const uint64_t seed = params.run.seed + kSeedStride * static_cast<uint64_t>(attempt);
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  return Closer(complex, hull, seed, run).Run(attempt, &run);
}

absl::StatusOr<CellComplex> CloseUnwatched(const CellComplex& complex, const Hull& hull,
                                           const MeshingParams& params, const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  return Closer(complex, hull, params.run.seed, run).Run(0, nullptr);
}

absl::StatusOr<Mended> MendBoundary(const CellComplex& complex, const Hull& hull, int layers,
                                    const MeshingParams& params, RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  return Closer(complex, hull, params.run.seed, run).Mend(layers);
}

absl::StatusOr<Refilled> RefillOpening(const CellComplex& complex, const Hull& hull,
                                       const Opening& opening, const MeshingParams& params,
                                       const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  return Closer(complex, hull, params.run.seed, run).Refill(opening);
}

}  // namespace amhex
