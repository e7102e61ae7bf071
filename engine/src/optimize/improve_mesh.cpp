#include "optimize/improve_mesh.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "closure/boundary_defects.h"
#include "closure/close_complex.h"
#include "closure/improve_closure.h"
#include "closure/peel_stars.h"
#include "optimize/hull_features.h"
#include "optimize/place_vertices.h"
#include "optimize/raise_quality.h"

namespace amhex {
namespace {

// Each round asks for a little more and looks a little farther.
struct ImprovementRound {
  double quality;  // cells below this scaled Jacobian are replaced
  int depth;       // neighbours absorbed at most
};
constexpr ImprovementRound kRounds[] = {{0.20, 5}, {0.23, 6}, {0.26, 7}, {0.28, 7}};

// One star in ten thousand cells can hold the minimum where no repair of it helps. Where the worst
// cell is below this, such places are opened and filled anew, each time a layer wider.
constexpr double kGoodMinimum = 0.26;
constexpr int kMaxRefills = 4;
// Each costs a placing of the whole mesh: two are what large ones can afford.
constexpr size_t kLargeMesh = 20'000;
constexpr int kMaxRefillsOfLarge = 2;
// Cells this little above the minimum are refilled along with the worst.
constexpr double kPoorMargin = 0.1;
constexpr double kMinRefillGain = 0.01;
// New boundary faces and moved vertices may cut off or add this many cells, and this share of all;
// a place that is lost shows in more.
constexpr double kMaxVolumeChange = 0.5;
constexpr double kMaxVolumeChangeShare = 1e-4;

// Moved vertices can close a notch of the boundary to a slit; mending looks a layer farther each
// time.
constexpr int kMaxMends = 4;

double VolumeOf(const CellComplex& complex) {
  double volume = 0;
  for (const CellCorners& cell : complex.cells) volume += CellVolume(cell, complex.vertices);
  return volume;
}

// True if a refilled complex covers what it did before and its boundary has no defect.
bool IsSameSolid(const CellComplex& refilled, const CellComplex& before, const Hull& hull) {
  const double permitted = kMaxVolumeChange + kMaxVolumeChangeShare * hull.volume;
  return std::abs(VolumeOf(refilled) - VolumeOf(before)) < permitted &&
         FindBoundaryDefects(WorkingMesh(refilled), hull).empty();
}

// Keeps what raises the minimum.
absl::StatusOr<CellComplex> RefillPoorest(CellComplex complex, const Hull& hull,
                                          const HullFeatures& features, const MeshingParams& params,
                                          RunContext& run) {
  bool is_refilled = false;
  double minimum = SummarizeQuality(complex).minimum;
  const int most = complex.cells.size() > kLargeMesh ? kMaxRefillsOfLarge : kMaxRefills;
  for (int layers = 0; layers < most && minimum < kGoodMinimum; ++layers) {
    const PoorCells poor{std::min(kGoodMinimum, minimum + kPoorMargin), layers};
    absl::StatusOr<Mended> refilled = RefillPoorCells(complex, hull, poor, params, run);
    if (absl::Status stopped = run.CheckStop(); !stopped.ok()) return stopped;
    if (!refilled.ok()) continue;  // the place resists; what is there is valid
    AMHEX_ASSIGN_OR_RETURN(CellComplex placed, PlaceVertices(std::move(refilled->complex), features,
                                                             run, PlacementEffort::kValid));
    const double reached = SummarizeQuality(placed).minimum;
    if (reached < minimum + kMinRefillGain || !IsSameSolid(placed, complex, hull)) continue;
    complex = std::move(placed);
    minimum = reached;
    is_refilled = true;
  }
  if (!is_refilled) return complex;
  return PlaceVertices(std::move(complex), features, run, PlacementEffort::kRaise);
}

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
  return RefillPoorest(std::move(complex), hull, features, params, run);
}

}  // namespace amhex
