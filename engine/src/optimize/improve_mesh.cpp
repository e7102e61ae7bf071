#include "optimize/improve_mesh.h"

#include <iterator>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "closure/close_complex.h"
#include "closure/improve_closure.h"
#include "closure/peel_stars.h"
#include "optimize/place_vertices.h"
#include "reassembly/merge_others.h"

namespace amhex {
namespace {

// Each round asks for a little more and looks a little farther.
struct ImprovementRound {
  double quality;  // cells below this scaled Jacobian are replaced
  int depth;       // neighbours absorbed at most
};
constexpr ImprovementRound kImprovementRounds[] = {{0.20, 5}, {0.23, 6}, {0.26, 7}, {0.28, 7}};

// So many rounds first put up with cells that fold in what is left of a peeled star, and move the
// vertices before anything is repaired: most unfold.
constexpr size_t kFoldingRounds = 2;

// Moved vertices can close a notch of the boundary to a slit; mending looks a layer farther each
// time. What could not be filled so often, one after the other, hardly ever is a layer farther.
constexpr int kMaxMends = 4;
constexpr int kVainMends = 2;

}  // namespace

absl::StatusOr<ImprovedMesh> ImproveMesh(CellComplex complex, const Improvement& with,
                                         RunContext& run) {
  // Between changes of the cells only what has changed since the last time is worth a look.
  CellComplex settled, peeled;
  const auto place = [&](PlacementEffort effort) -> absl::Status {
    const bool has_settled = effort == PlacementEffort::kValid && !settled.cells.empty();
    AMHEX_ASSIGN_OR_RETURN(complex, PlaceVertices(std::move(complex), with.features, run, effort,
                                                  with.device, has_settled ? &settled : nullptr));
    settled = complex;
    return absl::OkStatus();
  };
  bool is_placed = false;
  for (size_t i = 0; i < std::size(kImprovementRounds); ++i) {
    if (!is_placed) {
      AMHEX_RETURN_IF_ERROR(place(PlacementEffort::kValid));
    }
    const std::vector<CellCorners> before = complex.cells;
    // Repairs and moves make room: what could not be peeled or joined a round ago may be now.
    // Not where the last round asked for the same and changed nothing.
    const StarFolds folds = i < kFoldingRounds ? StarFolds::kAllowed : StarFolds::kRefused;
    if (!is_placed || i <= kFoldingRounds) {
      AMHEX_ASSIGN_OR_RETURN(CellComplex rest, PeelStars(complex, folds, run, peeled));
      peeled = std::exchange(complex, std::move(rest));
      AMHEX_ASSIGN_OR_RETURN(complex, JoinStars(complex, with.hull, run));
      AMHEX_ASSIGN_OR_RETURN(
          complex, MergeOthers(std::move(complex), with.params.input.sharp_angle_degrees, run));
    }
    if (folds == StarFolds::kAllowed && complex.cells != before) {
      AMHEX_RETURN_IF_ERROR(place(PlacementEffort::kValid));
    }
    AMHEX_ASSIGN_OR_RETURN(complex, RepairCells(complex, with.hull,
                                                {.quality = kImprovementRounds[i].quality,
                                                 .depth = kImprovementRounds[i].depth},
                                                run));
    is_placed = complex.cells == before;
  }
  AMHEX_RETURN_IF_ERROR(place(is_placed ? PlacementEffort::kRaise : PlacementEffort::kBest));
  bool is_sound = false;
  int in_vain = 0;
  for (int layers = 0; layers < kMaxMends && !is_sound && in_vain < kVainMends; ++layers) {
    AMHEX_ASSIGN_OR_RETURN(Mended mended,
                           MendBoundary(complex, with.hull, layers, with.params, run));
    complex = std::move(mended.complex);
    in_vain = mended.resists ? in_vain + 1 : 0;
    is_sound = !mended.resists && !mended.changed;
    if (mended.changed) AMHEX_RETURN_IF_ERROR(place(PlacementEffort::kValid));
  }
  return ImprovedMesh{std::move(complex), !is_sound};
}

}  // namespace amhex
