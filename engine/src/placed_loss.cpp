#include "placed_loss.h"

#include <algorithm>

#include "closure/rank_complexes.h"
#include "optimize/hull_deviation.h"
#include "optimize/hull_samples.h"
#include "optimize/raise_quality.h"
#include "output/finalize_mesh.h"
#include "output/mesh_statistics.h"

namespace amhex {
namespace {

constexpr double kMinimumWeight = 0.5;
// Each tenth of an edge length between input and mesh beyond what is asked of a boundary
// (optimize/hull_deviation) counts as much as half a hundredth of the average.
constexpr double kDistanceWeight = 0.05;
// Nobody wants a mesh that lacks an ear for better cells elsewhere: an edge length that is lost
// counts as much as half of the average.
constexpr double kLostWeight = 0.5;
constexpr double kLostFrom = 0.75 * kLostDistance;  // what drawing leaves may be a little farther

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
  const auto cells = static_cast<double>(placed.cells.size());
  // Of points that scatter the farthest are noise.
  const double lost = PointsScatter(hull, poll) ? 0 : std::max(0.0, distance - kLostFrom);
  return {1 - quality.average + DeviationLoss(cells, WantedCells(hull, poll)),
          kMinimumWeight * std::max(0.0, good_minimum - quality.minimum),
          kDistanceWeight * std::max(0.0, distance - LimitsFor(hull).limit), kLostWeight * lost};
}

}  // namespace amhex
