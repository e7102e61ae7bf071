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
        most_carved_parts_(kCarvedParts + static_cast<int64_t>(hull.volume * kCarvedPartsPerCell)) {
  }

  // `watched`, if any, is told of progress.
  absl::StatusOr<CellComplex> Run(int layers, RunContext* watched) {
    watched_ = watched;
    RemoveLooseCells(&mesh_);
    SnapFacesToHull(hull_, &mesh_);
    ExtrudeToHull(hull_, &mesh_);
    FillWedges(hull_, &mesh_, StopPoll(run_));
    for (int layer = 0; layer < layers; ++layer) RemoveCellsAtCavities();
    first_open_ = std::max<size_t>(1, mesh_.OpenFaces().size());
    for (const StarRound& round : kFirstRounds) {
      FillWithStars(round);
      RemoveLooseCells(&mesh_);
    }
    std::optional<WorkingMesh> with_far_faces;
    for (int attempt = 0; attempt < kDefectAttempts; ++attempt) {
      FillCavities(attempt);
      if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
      if (HasOpenFaces()) break;
      const BoundaryDefects defects = FindBoundaryDefects(mesh_, hull_, StopPoll(run_));
      if (defects.vertices.empty()) break;
      if (!with_far_faces.has_value() && defects.are_just_far) with_far_faces = mesh_;
      OpenAt(defects.vertices, 0);
    }
    FillCavities(kDefectAttempts);
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
    mended.changed = !defects.vertices.empty();
    if (mended.changed) {
      OpenAt(defects.vertices, layers);
      LimitCarving();
      FillCavities(kDefectAttempts + 1 + layers);
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
    FillCavities(kRefillRound + static_cast<int>(opening.first));
    if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
    if (HasOpenFaces()) return OpenError();
    refilled.complex = mesh_.ToComplex(StopPoll(run_));
    return refilled;
  }

 private:
  bool HasOpenFaces() const { return mesh_.HasOpenFaces(); }

  void FillCavities(int round) {
    for (int attempt = 0; attempt < kFillAttempts && HasOpenFaces(); ++attempt) {
      if (run_.ShouldStop()) return;
      if (attempt > 0) {
        RemoveCellsAtCavities();
        RemoveLooseCells(&mesh_);
        for (const StarRound& star_round : kSlitRounds) FillWithStars(star_round);
      }
      const auto salt =
          uint64_t{kFillAttempts} * static_cast<uint64_t>(round) + static_cast<uint64_t>(attempt);
      for (const FillStep& step : kFillSteps) {
        CarveNetworks(step.carving);
        FillWithStars(kFirstRounds[1]);
        DeclareHullFaces(hull_, &mesh_);
        if (step.max_cells_per_face > 0) FillLocally(seed_ + salt, step.max_cells_per_face);
      }
      FillWithStars(kDeepRound);
    }
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

  void LimitCarving() {
    const auto open = static_cast<int64_t>(mesh_.OpenFaces().size());
    most_carved_parts_ = std::min(most_carved_parts_, kPartsOfOpening + kPartsPerOpenedFace * open);
  }

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

  // A cavity that a star round has failed to fill is not tried again before it has changed.
  using Attempt = std::pair<int, std::vector<int>>;
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
