#include "optimize/improve_mesh.h"

#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "closure/close_complex.h"
#include "closure/improve_closure.h"
#include "closure/peel_stars.h"
#include "optimize/hull_features.h"
#include "optimize/place_vertices.h"

namespace amhex {
namespace {

// Each round asks for a little more and looks a little farther.
struct ImprovementRound {
  double quality;  // cells below this scaled Jacobian are replaced
  int depth;       // neighbours absorbed at most
};
constexpr ImprovementRound kRounds[] = {{0.20, 5}, {0.23, 6}, {0.26, 7}, {0.28, 7}};

// Moved vertices can close a notch of the boundary to a slit; mending looks a layer farther each
// time.
constexpr int kMaxMends = 4;

}  // namespace

absl::StatusOr<CellComplex> ImproveMesh(CellComplex complex, const Hull& hull,
                                        const MeshingParams& params, RunContext& run) {
  const HullFeatures features(hull, StopPoll(run));
  const auto place = [&](PlacementEffort effort) {
    return PlaceVertices(std::move(complex), features, run, effort);
  };
  bool is_placed = false;
  for (const ImprovementRound& round : kRounds) {
    if (!is_placed) {
      AMHEX_ASSIGN_OR_RETURN(complex, place(PlacementEffort::kValid));
    }
    const std::vector<CellCorners> before = complex.cells;
    // Repairs and moves make room: what could not be peeled or joined a round ago may be now.
    AMHEX_ASSIGN_OR_RETURN(complex, PeelStars(complex, run));
    AMHEX_ASSIGN_OR_RETURN(complex, JoinStars(complex, hull, run));
    AMHEX_ASSIGN_OR_RETURN(complex, RepairCells(complex, hull, round.quality, round.depth, run));
    is_placed = complex.cells == before;
  }
  AMHEX_ASSIGN_OR_RETURN(complex,
                         place(is_placed ? PlacementEffort::kRaise : PlacementEffort::kBest));
  for (int layers = 0; layers < kMaxMends; ++layers) {
    AMHEX_ASSIGN_OR_RETURN(Mended mended, MendBoundary(complex, hull, layers, params, run));
    complex = std::move(mended.complex);
    if (!mended.changed) break;
    AMHEX_ASSIGN_OR_RETURN(complex, place(PlacementEffort::kValid));
  }
  return complex;
}

}  // namespace amhex
