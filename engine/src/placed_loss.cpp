#include "placed_loss.h"

#include <algorithm>

#include "closure/rank_complexes.h"
#include "input/wanted_cells.h"
#include "optimize/hull_deviation.h"
#include "optimize/hull_features.h"
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

// A tunnel where the input has none passes for a solid in nobody's simulation, however thin it is.
constexpr double kHandleWeight = 0.1;

// Handles and parts that the input does not have. What it has and the mesh lacks, such as holes
// thinner than a cell, no other lattice would keep.
int64_t SurplusOf(const BoundaryMeasures& measured, const Hull& hull) {
  if (!hull.is_given || hull.genus < 0) return 0;
  return std::max<int64_t>(0, measured.genus - hull.genus) +
         std::max<int64_t>(0, measured.component_count - hull.component_count);
}

}  // namespace

PlacedLoss LossOf(const CellComplex& placed, const Improvement& with, double good_minimum,
                  const StopPoll& poll) {
  const Hull& hull = with.hull;
  const QualitySummary quality = SummarizeQuality(placed, poll);
  const double limit = LimitsFor(hull).limit;
  const BoundaryMeasures measured =
      MeasureBoundary(FinalizeMesh(placed, hull.frame, poll), hull, limit, poll, with.device);
  const double distance = measured.farthest;
  const auto cells = static_cast<double>(placed.cells.size());
  // Of points that scatter the farthest are noise. What is near enough is not lost, however small
  // the cells.
  const double lost_from = std::max(limit, kLostFrom);
  const double lost = with.features.points_scatter() ? 0 : std::max(0.0, distance - lost_from);
  return {.cells = 1 - quality.average + DeviationLoss(cells, WantedCells(hull, poll)),
          .minimum = kMinimumWeight * std::max(0.0, good_minimum - quality.minimum),
          .distance = kDistanceWeight * std::max(0.0, distance - limit),
          .lost = kLostWeight * lost,
          .handles = kHandleWeight * static_cast<double>(SurplusOf(measured, hull))};
}

}  // namespace amhex
