#include "placed_loss.h"

#include <algorithm>

#include "closure/rank_complexes.h"
#include "optimize/raise_quality.h"
#include "output/finalize_mesh.h"
#include "output/mesh_statistics.h"

namespace amhex {
namespace {

constexpr double kMinimumWeight = 0.5;
// Beyond the larger of these distances between input and mesh, edge lengths and a share of the
// box's diagonal, each tenth of an edge length counts as much as half a hundredth of the average.
constexpr double kGoodDistance = 1.0 / 6;
constexpr double kGoodShareOfDiagonal = 0.005;
constexpr double kDistanceWeight = 0.05;

}  // namespace

PlacedLoss LossOf(const CellComplex& placed, const Improvement& with, double good_minimum,
                  const StopPoll& poll) {
  const Hull& hull = with.hull;
  const QualitySummary quality = SummarizeQuality(placed, poll);
  const MeshStatistics measured =
      MeasureMesh(FinalizeMesh(placed, hull.frame, poll), hull, poll, with.device);
  const double diagonal = hull.box.Diagonal();  // edge lengths
  const double distance =
      std::max(measured.mesh_to_input_max, measured.input_to_mesh_max) * diagonal;
  const double good_distance = std::max(kGoodDistance, kGoodShareOfDiagonal * diagonal);
  return {1 - quality.average + DeviationLoss(static_cast<double>(placed.cells.size()), hull),
          kMinimumWeight * std::max(0.0, good_minimum - quality.minimum),
          kDistanceWeight * std::max(0.0, distance - good_distance)};
}

}  // namespace amhex
