#include "optimize/place_vertices.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "optimize/cell_quality.h"
#include "optimize/hull_features.h"
#include "optimize/placement.h"
#include "optimize/project_to_hull.h"
#include "optimize/raise_average.h"
#include "optimize/raise_jointly.h"
#include "optimize/raise_quality.h"
#include "optimize/report_cells.h"
#include "optimize/unsettled_vertices.h"

namespace amhex {
namespace {

// Quality that projection may cost a cell, round by round: the first rounds leave what would hurt
// to later ones, when the neighbours have made room.
constexpr std::array<double, 8> kProjectionFloors = {0.4, 0.4, 0.35, 0.35, 0.3, 0.3, 0.25, 0.25};
// After this round, creases and corners that are farther than kUnreached are given up.
constexpr size_t kWeakenAfterRound = 5;
constexpr double kUnreached = 0.02;  // edge lengths
constexpr double kReached = 1e-6;    // edge lengths
constexpr int kSweepsPerRound = 2;
// Cells below this are improved between the rounds of projection.
constexpr double kRoundTarget = 0.7;

// Sweeps until hardly anything moves, at most.
constexpr int kEvenSweeps = 8;
constexpr int kAverageSweeps = 40;
constexpr double kEvenTarget = 0.6;
// Raising the worst cells: the penalty is steep enough that the worst corner outweighs all others
// of its neighbourhood, and its knee follows the minimum as it rises. First broadly, which evens
// out the worst cells with the merely poor ones; then steeply, where that stalls.
struct LevelShape {
  double steepness;
  double knee;    // above the minimum
  double target;  // above the minimum
  int max_levels;
};
constexpr LevelShape kLevelShapes[] = {{60.0, 0.05, 0.15, 10}, {150.0, 0.02, 0.06, 10}};
constexpr int kValidLevels = 3;  // between changes of the cells
constexpr int kSweepsPerLevel = 6;
constexpr double kLevelGain = 0.002;  // a level that raises the minimum less has failed
constexpr double kLeftBehind = 0.02;  // then cells this near to the minimum are left behind
constexpr double kGoodLevel = 0.8;    // no level starts above
// Creases are given up where they hold a cell below this, which would be refilled. Corners are not:
// the mesh would miss the input by most of an edge length there.
constexpr double kUnbearable = 0.3;
// Where the cells still change, places are raised jointly up to this only: what holds them may be
// gone with the next change, while vertices that have slid along the hull would stay where they
// are, and creases that they have left unfollowed.
constexpr double kWantedOnTheWay = 0.2;

class Placer {
 public:
  // `watched`, if any, is told of progress. Each step starts with the vertices `first`.
  Placer(Placement& placement, ActiveVertices first, const RunContext& run, RunContext* watched)
      : placement_(placement),
        first_(std::move(first)),
        run_(run),
        poll_(run),
        watched_(watched),
        vertex_count_(static_cast<int64_t>(placement.complex.vertices.size())),
        cells_by_type_(CountCells(placement.complex)) {}

  absl::Status Run(PlacementEffort effort) {
    absl::Status status;
    if (effort == PlacementEffort::kJoint) {
      RaiseJointly(placement_, kJointlyWanted, run_);
      return run_.CheckStop();
    }
    if (effort == PlacementEffort::kValid || effort == PlacementEffort::kBest) status = ReachHull();
    if (!status.ok()) return status;
    status = RaiseMinimum(effort);
    if (!status.ok()) return status;
    if (FreeUnbearable()) {
      status = RaiseMinimum(effort);
      if (!status.ok()) return status;
    }
    Report(0.6);
    if (effort == PlacementEffort::kValid || effort == PlacementEffort::kBearable) {
      return absl::OkStatus();
    }
    status = Sweep(RulesForAverage(placement_.complex, kLooseBound, poll_), kAverageSweeps);
    Report(1.0);
    return status;
  }

 private:
  // Rounds of projection, each followed by sweeps that make room for the next.
  absl::Status ReachHull() {
    SweepMemory memory = Start();
    const SweepRules rules{QualityAim::kMinimum, kRoundTarget, kRoundTarget};
    for (size_t round = 0; round < kProjectionFloors.size(); ++round) {
      const absl::StatusOr<int64_t> projected =
          ProjectToHull(placement_, first_, kProjectionFloors[round], memory, run_);
      if (!projected.ok()) return projected.status();
      absl::Status status = Sweep(rules, kSweepsPerRound, memory);
      if (!status.ok()) return status;
      const bool is_last = LargestOffset(placement_, first_, poll_) < kReached;
      if (is_last ? round <= kWeakenAfterRound : round == kWeakenAfterRound) {
        WeakenUnreached(placement_, kUnreached, poll_);
      }
      Report(0.4 * static_cast<double>(round + 1) / kProjectionFloors.size());
      if (is_last) break;
    }
    return absl::OkStatus();
  }

  absl::Status RaiseMinimum(PlacementEffort effort) {
    const double minimum = SummarizeQuality(placement_.complex, poll_).min_scaled_jacobian;
    absl::Status status = Sweep({QualityAim::kMinimum, kEvenTarget, minimum}, kEvenSweeps);
    for (const LevelShape& shape : kLevelShapes) {
      if (status.ok()) status = RaiseLevels(shape, GoalFor(effort, shape));
    }
    if (!status.ok()) return status;
    const bool is_on_the_way = effort == PlacementEffort::kValid;
    RaiseJointly(placement_, is_on_the_way ? kWantedOnTheWay : kJointlyWanted, run_);
    return run_.CheckStop();
  }

  // How far levels of this shape go.
  struct LevelGoal {
    int max_levels;
    double enough = kGoodLevel;  // no level starts above
    // Cells that a level cannot raise are left behind, or one hopeless cell would end it for all
    // others.
    bool leaves_behind = true;
  };
  static LevelGoal GoalFor(PlacementEffort effort, const LevelShape& shape) {
    if (effort == PlacementEffort::kValid) return {kValidLevels};
    if (effort == PlacementEffort::kBearable) return {shape.max_levels, kBearable, false};
    return {shape.max_levels};
  }

  absl::Status RaiseLevels(const LevelShape& shape, const LevelGoal& goal) {
    std::vector<uint8_t> hopeless = FixedCells();
    const std::vector<float>& quality = placement_.survey.min_scaled_jacobian;
    for (int level = 0; level < goal.max_levels; ++level) {
      const double minimum = LeastOf(quality, hopeless);
      if (minimum >= goal.enough) break;
      absl::Status status = Sweep({QualityAim::kMinimum, minimum + shape.target, minimum,
                                   CornerPenalty{minimum + shape.knee, shape.steepness}},
                                  kSweepsPerLevel);
      if (!status.ok()) return status;
      if (LeastOf(quality, hopeless) >= minimum + kLevelGain) continue;
      if (!goal.leaves_behind) break;
      for (size_t c = 0; c < quality.size(); ++c) {
        if (quality[c] < minimum + kLeftBehind) hopeless[c] = 1;
      }
    }
    return absl::OkStatus();
  }

  // 1 for cells none of whose vertices may move.
  std::vector<uint8_t> FixedCells() const {
    const auto is_fixed = [this](int32_t v) {
      return placement_.constraints.vertex[v].kind == Constraint::kFixed;
    };
    std::vector<uint8_t> fixed;
    for (const CellCorners& corners : placement_.complex.cells) {
      fixed.push_back(std::all_of(corners.begin(), corners.end(), is_fixed) ? 1 : 0);
    }
    return fixed;
  }

  static double LeastOf(const std::vector<float>& quality, const std::vector<uint8_t>& hopeless) {
    double least = 1;
    for (size_t c = 0; c < quality.size(); ++c) {
      if (!hopeless[c]) least = std::min<double>(least, quality[c]);
    }
    return least;
  }

  // Frees the crease vertices of every cell of unbearable quality to their patches.
  bool FreeUnbearable() {
    bool any = false;
    for (size_t c = 0; c < placement_.complex.cells.size(); ++c) {
      // Only cells that may be poor or fold are worth a closer look.
      if (placement_.survey.min_scaled_jacobian[c] > 2 * kUnbearable &&
          !placement_.survey.near_folding[c]) {
        continue;
      }
      const CellCorners& corners = placement_.complex.cells[c];
      if (CellQuality(corners, placement_.complex.vertices) >= kUnbearable) continue;
      for (const int32_t v : corners) {
        VertexConstraint& constraint = placement_.constraints.vertex[v];
        if (constraint.kind != Constraint::kCrease) continue;
        constraint = Weakened(constraint, placement_.complex.vertices[v], placement_.features);
        any = true;
      }
    }
    return any;
  }

  SweepMemory Start() const {
    SweepMemory memory = StartSweeps(vertex_count_);
    memory.active = first_;
    return memory;
  }

  absl::Status Sweep(const SweepRules& rules, int sweep_count) {
    SweepMemory memory = Start();
    return Sweep(rules, sweep_count, memory);
  }

  absl::Status Sweep(const SweepRules& rules, int sweep_count, SweepMemory& memory) {
    return RunSweeps(placement_, rules, sweep_count, memory, run_);
  }

  void Report(double fraction) {
    if (watched_ == nullptr) return;
    Progress progress = watched_->progress();
    progress.stage_fraction = fraction;
    progress.cell_count = static_cast<int64_t>(placement_.complex.cells.size());
    progress.cells_by_type = cells_by_type_;
    const std::vector<float>& quality = placement_.survey.min_scaled_jacobian;
    if (!quality.empty()) {
      progress.min_scaled_jacobian = *std::min_element(quality.begin(), quality.end());
      progress.average_scaled_jacobian = std::accumulate(quality.begin(), quality.end(), 0.0) /
                                         static_cast<double>(quality.size());
    }
    watched_->Report(progress);
  }

  Placement& placement_;
  const ActiveVertices first_;
  const RunContext& run_;
  const StopPoll poll_;
  RunContext* const watched_;
  int64_t vertex_count_ = 0;
  const CellCounts cells_by_type_;
};

absl::Status CheckCells(const CellComplex& complex) {
  for (size_t c = 0; c < complex.cells.size(); ++c) {
    if (FindCellPattern(complex.cells[c]) == nullptr) {
      return absl::InternalError(absl::StrCat("vertex placement: cell ", c, " of ",
                                              complex.cells.size(),
                                              " has no pattern of an at-most-hexa cell"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<CellComplex> PlaceVertices(CellComplex complex, const HullFeatures& features,
                                          RunContext& run, PlacementEffort effort,
                                          DeviceUse* device, const CellComplex* settled) {
  absl::Status status = CheckCells(complex);
  if (!status.ok()) return status;
  if (complex.cells.empty()) return complex;
  status = run.CheckStop();
  if (!status.ok()) return status;
  // Judge the maps that the output will have.
  for (CellCorners& corners : complex.cells) corners = AsListedInFigure2(corners);
  Placement placement = PreparePlacement(complex, features, StopPoll(run));
  placement.device = device;
  ActiveVertices first = settled == nullptr ? AllVertices(placement)
                                            : UnsettledVertices(placement, *settled, StopPoll(run));
  status = Placer(placement, std::move(first), run, &run).Run(effort);
  if (!status.ok()) return status;
  return complex;
}

absl::StatusOr<CellComplex> PlacePart(CellComplex part, const std::vector<uint8_t>& fixed,
                                      const HullFeatures& features, const RunContext& run,
                                      PlacementEffort effort) {
  absl::Status status = CheckCells(part);
  status.Update(run.CheckStop());
  if (!status.ok()) return status;
  for (CellCorners& corners : part.cells) corners = AsListedInFigure2(corners);
  Placement placement = PreparePlacement(part, features, StopPoll(run));
  for (size_t v = 0; v < fixed.size(); ++v) {
    if (fixed[v]) placement.constraints.vertex[v] = {Constraint::kFixed, -1, -1, -1};
  }
  status = Placer(placement, AllVertices(placement), run, nullptr).Run(effort);
  if (!status.ok()) return status;
  return part;
}

}  // namespace amhex
