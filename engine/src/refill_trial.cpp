#include "refill_trial.h"

#include <utility>

#include "base/status_macros.h"
#include "closure/close_complex.h"
#include "optimize/divide_poor_cells.h"
#include "optimize/draw_rest.h"
#include "optimize/follow_hull.h"
#include "optimize/lengthen_edges.h"
#include "optimize/raise_average.h"
#include "optimize/refill_places.h"
#include "output/finalize_mesh.h"
#include "output/validate.h"
#include "placed_loss.h"
#include "split_where_paid.h"

namespace amhex {
namespace {

// Of one trial, the first one included.
constexpr int kMaxFillings = 3;
// Of more places that stay too far from the hull hardly all come near.
constexpr size_t kMostPlacesDrawnAgain = 8;

// The last steps towards the hull: places that are still too far from it are drawn there or get a
// vertex more, and edges become long enough. At an edge of next to no length nothing could move, so
// a few places are drawn once more after that.
absl::StatusOr<RestDrawn> Finish(CellComplex complex, const Improvement& with,
                                 const RunContext& run) {
  const auto lengthen = [&](RestDrawn drawn) -> absl::StatusOr<RestDrawn> {
    AMHEX_ASSIGN_OR_RETURN(drawn.complex,
                           LengthenEdges(std::move(drawn.complex), with.hull, with.features, run));
    return drawn;
  };
  AMHEX_ASSIGN_OR_RETURN(RestDrawn drawn,
                         DrawRest(std::move(complex), with.hull, with.features, run));
  if (drawn.is_near()) return lengthen(std::move(drawn));
  AMHEX_ASSIGN_OR_RETURN(drawn.complex, SplitRest(std::move(drawn.complex), with, run));
  AMHEX_ASSIGN_OR_RETURN(const RestDrawn split, lengthen(std::move(drawn)));
  AMHEX_ASSIGN_OR_RETURN(
      drawn, DrawRest(split.complex, with.hull, with.features, run, kMostPlacesDrawnAgain));
  if (drawn.complex.vertices == split.complex.vertices) return drawn;
  return lengthen(std::move(drawn));
}

}  // namespace

absl::StatusOr<RefilledTrial> RefillTrial(const CellComplex& placed, bool is_followed,
                                          const Improvement& with, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(CellComplex refilled,
                         RefillPlaces(placed, with.hull, with.features, with.params, run));
  AMHEX_ASSIGN_OR_RETURN(
      refilled, DividePoorCells(std::move(refilled), {with.hull, with.features, with.params, run}));
  if (!is_followed) {
    AMHEX_ASSIGN_OR_RETURN(refilled,
                           RaiseAverage(std::move(refilled), with.features, run, with.device));
  }
  if (!is_followed || refilled.cells != placed.cells || refilled.vertices != placed.vertices) {
    AMHEX_ASSIGN_OR_RETURN(refilled,
                           FollowHull(std::move(refilled), with.hull, with.features, run));
  }
  AMHEX_ASSIGN_OR_RETURN(refilled,
                         SplitWherePaid(std::move(refilled), with, kMendableMinimum, run));
  AMHEX_ASSIGN_OR_RETURN(RestDrawn drawn, Finish(std::move(refilled), with, run));
  const StopPoll poll(run);
  const bool is_valid =
      ValidateMesh(FinalizeMesh(drawn.complex, with.hull.frame, poll), poll, with.device).valid();
  return RefilledTrial{std::move(drawn.complex), is_valid,
                       drawn.places_left > kMostPlacesDrawnAgain};
}

absl::StatusOr<RefilledTrial> FillAnew(const CellComplex& assembled, const Improvement& with,
                                       RunContext& run) {
  absl::StatusOr<RefilledTrial> last =
      absl::InternalError("no valid mesh was found; try another cell count");
  for (int filling = 1; filling < kMaxFillings && !(last.ok() && last->is_valid); ++filling) {
    absl::StatusOr<CellComplex> closed =
        CloseComplex(assembled, with.hull, with.params, run, {.attempt = filling});
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
    if (!closed.ok()) {
      if (!last.ok()) last = closed.status();
      continue;
    }
    AMHEX_ASSIGN_OR_RETURN(const ImprovedMesh placed, ImproveMesh(*std::move(closed), with, run));
    AMHEX_ASSIGN_OR_RETURN(last, RefillTrial(placed.complex, false, with, run));
  }
  return last;
}

}  // namespace amhex
