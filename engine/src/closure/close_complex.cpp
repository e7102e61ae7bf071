#include "closure/close_complex.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "closure/boundary_defects.h"
#include "closure/cavity_filler.h"
#include "closure/defect_places.h"
#include "closure/extrude_layer.h"
#include "closure/fill_wedges.h"
#include "closure/prepare_cavities.h"
#include "optimize/report_cells.h"

namespace amhex {
namespace {

// Boundary defects are opened and filled anew, each time that they come again a layer farther.
constexpr int kDefectAttempts = 6;
// What could not be filled so often, one after the other, hardly ever is a layer farther.
constexpr int kVainAttempts = 2;
// Rounds of refilling have seeds of their own, beyond those of closing.
constexpr int kRefillRound = 2 * kDefectAttempts;
// Seeds of one attempt are counted up from its own base.
constexpr uint64_t kSeedStride = 1000;

class Closer {
 public:
  Closer(const CellComplex& complex, const Hull& hull, uint64_t seed, const RunContext& run)
      : hull_(hull), run_(run), filler_(complex, hull, seed, run), mesh_(filler_.mesh()) {}

  // `watched`, if any, is told of progress.
  absl::StatusOr<CellComplex> Run(const Closing& closing, RunContext* watched) {
    bool may_place = closing.place && !mesh_.HasOpenFaces();
    RemoveLooseCells(&mesh_);
    SnapFacesToHull(hull_, &mesh_);
    ExtrudeToHull(hull_, &mesh_);
    FillWedges(hull_, &mesh_, StopPoll(run_));
    for (int layer = 0; layer < closing.attempt; ++layer) filler_.RemoveCellsAtCavities();
    prefers_tetrahedra_ = closing.attempt > 0;
    filler_.Watch(watched);
    for (const StarRound& round : kFirstRounds) {
      filler_.FillWithStars(round);
      RemoveLooseCells(&mesh_);
    }
    filler_.FillByStars(0);
    AMHEX_RETURN_IF_ERROR(CheckOthers(closing));
    if (closing.may_fail) filler_.ClearLess();
    filler_.ClearAndFill();
    if (!closing.may_fail) filler_.FillByTetrahedra(0);
    AMHEX_RETURN_IF_ERROR(CheckOthers(closing));
    std::optional<WorkingMesh> with_far_faces;
    const int most_in_vain = closing.may_fail ? 1 : kVainAttempts;
    int in_vain = 0;
    for (int attempt = 1; attempt <= kDefectAttempts && in_vain < most_in_vain; ++attempt) {
      if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
      if (mesh_.HasOpenFaces()) break;
      BoundaryDefects defects = FindBoundaryDefects(mesh_, hull_, StopPoll(run_));
      if (!defects.vertices.empty() && std::exchange(may_place, false)) {
        AMHEX_ASSIGN_OR_RETURN(const CellComplex placed,
                               closing.place(mesh_.ToComplex(StopPoll(run_))));
        mesh_ = WorkingMesh(placed, StopPoll(run_));
        defects = FindBoundaryDefects(mesh_, hull_, StopPoll(run_));
      }
      if (defects.vertices.empty()) break;
      if (!with_far_faces.has_value() && defects.are_just_far) with_far_faces = mesh_;
      in_vain = FillOpened(defects, 0, attempt) ? 0 : in_vain + 1;
      if (in_vain > 0 && defects.are_just_far) break;
    }
    if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
    if (with_far_faces.has_value() && IsNoBetterThan(*with_far_faces)) {
      mesh_ = *std::move(with_far_faces);
    }
    // What is left of defects is for the validator to judge.
    if (mesh_.HasOpenFaces()) return OpenError();
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
      filler_.ClearLess();
      mended.changed = FillOpened(defects, layers, kDefectAttempts + 1 + layers);
      mended.resists = !mended.changed && !defects.are_just_far;
    }
    if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
    if (with_far_faces.has_value() && IsNoBetterThan(*with_far_faces)) {
      mended.changed = false;
      mesh_ = *std::move(with_far_faces);
    }
    if (mesh_.HasOpenFaces()) return OpenError();
    mended.complex = mesh_.ToComplex(StopPoll(run_));
    return mended;
  }

  absl::StatusOr<Refilled> Refill(const Opening& opening) {
    for (const int32_t cell : opening.cells) mesh_.RemoveCell(cell);
    filler_.CarveAtMostForOpening();
    Refilled refilled;
    if (opening.first == FirstFilling::kStars) {
      refilled.first_was_in_vain = true;
      for (const StarRound& round : kFirstRounds) {
        if (filler_.FillWithStars(round)) refilled.first_was_in_vain = false;
      }
    }
    const int round = kRefillRound + static_cast<int>(opening.first);
    filler_.FillByStars(round, kFillAttempts);
    filler_.FillByTetrahedra(round);
    if (absl::Status status = run_.CheckStop(); !status.ok()) return status;
    if (mesh_.HasOpenFaces()) return OpenError();
    refilled.complex = mesh_.ToComplex(StopPoll(run_));
    return refilled;
  }

 private:
  // Opens the mesh at these and fills it again, at each place on its own where that fails as a
  // whole; where it fails, too, the mesh is as before: filled by tetrahedra over all of it, it
  // would hardly have a hexahedron left. So it is where no other filling was valid, though. False
  // if nothing has changed.
  bool FillOpened(const BoundaryDefects& defects, int layers, int round) {
    // A mesh that is merely far from the hull somewhere is worth no clearing.
    const bool may_clear = !defects.are_just_far;
    size_t left = defects.vertices.size();
    if (TryOpened(defects.vertices, may_clear, layers, round, &left)) return true;
    bool any = false;
    const std::vector<std::vector<int32_t>> places = PlacesOf(defects.vertices, mesh_);
    for (const std::vector<int32_t>& place : places) {
      if (places.size() == 1 || run_.ShouldStop()) break;
      if (TryOpened(place, may_clear, layers, round, &left)) any = true;
    }
    return any;
  }

  // Where stars do not fill what was opened, only what leaves fewer than `left` vertices at defects
  // is kept; sets that.
  bool TryOpened(const std::vector<int32_t>& defects, bool may_clear, int layers, int round,
                 size_t* left) {
    CavityFiller::State before = filler_.Save();
    OpenAt(defects, layers);
    if (round > kDefectAttempts) {
      filler_.CarveAtMostForOpening();
    } else {
      filler_.CarveAtLeastForOpening();
    }
    filler_.FillByStars(round);
    if (!mesh_.HasOpenFaces()) return true;
    if (may_clear) filler_.ClearAndFill();
    if (HasFewerDefects(left)) return true;
    if (prefers_tetrahedra_) {
      filler_.FillByTetrahedra(round);
      return true;
    }
    filler_.GoBackTo(std::move(before));
    return false;
  }

  bool HasFewerDefects(size_t* left) const {
    if (mesh_.HasOpenFaces()) return false;
    const BoundaryDefects defects = FindBoundaryDefects(mesh_, hull_, StopPoll(run_));
    if (defects.vertices.size() >= *left) return false;
    *left = defects.vertices.size();
    return true;
  }

  // What is merely far from the hull may be closed better once it is opened, or in vain, or by
  // giving up what was far away.
  bool IsNoBetterThan(const WorkingMesh& with_far_faces) const {
    return mesh_.HasOpenFaces() ||
           !FindBoundaryDefects(mesh_, hull_, StopPoll(run_)).vertices.empty() ||
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
      if (layer > 0) filler_.RemoveCellsAtCavities();
    }
    std::sort(opened.begin(), opened.end());
    opened.erase(std::unique(opened.begin(), opened.end()), opened.end());
    for (const int32_t v : opened) ++times_opened_[v];
    for (const StarRound& round : kSlitRounds) filler_.FillWithStars(round);
  }

  absl::Status CheckOthers(const Closing& closing) const {
    int64_t others = 0;
    for (int cell = 0; cell < mesh_.cell_slots(); ++cell) {
      if (mesh_.alive(cell) && !mesh_.is_hexahedron(cell)) ++others;
    }
    if (static_cast<double>(others) <= closing.most_others) return absl::OkStatus();
    return absl::InternalError(
        absl::StrFormat("no better mesh was found: %d cells are no hexahedra, more than %g", others,
                        closing.most_others));
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
  const RunContext& run_;
  CavityFiller filler_;
  WorkingMesh& mesh_;                // the filler's
  std::vector<int> times_opened_;    // [vertex] as one of a cell at a defect
  bool prefers_tetrahedra_ = false;  // to boundary defects
};

uint64_t SeedOf(const Closing& closing, const MeshingParams& params) {
  return params.run.seed + kSeedStride * static_cast<uint64_t>(closing.attempt);
}

}  // namespace

absl::StatusOr<CellComplex> CloseComplex(const CellComplex& complex, const Hull& hull,
                                         const MeshingParams& params, RunContext& run,
                                         const Closing& closing) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  return Closer(complex, hull, SeedOf(closing, params), run).Run(closing, &run);
}

absl::StatusOr<CellComplex> CloseUnwatched(const CellComplex& complex, const Hull& hull,
                                           const MeshingParams& params, const RunContext& run,
                                           const Closing& closing) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  return Closer(complex, hull, SeedOf(closing, params), run).Run(closing, nullptr);
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
