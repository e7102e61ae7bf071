#include "optimize/place_vertices.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "optimize/hull_features.h"
#include "optimize/placement.h"
#include "optimize/project_to_hull.h"
#include "optimize/raise_quality.h"

namespace amhex {
namespace {

// Quality that projection may cost a cell, round by round: the first rounds leave what would hurt
// to later ones, when the neighbours have made room.
constexpr std::array<double, 8> kProjectionFloors = {0.4, 0.4, 0.3, 0.3, 0.2, 0.2, 0.1, 0.1};
// After this round, creases and corners that are farther than kUnreached are given up.
constexpr size_t kWeakenAfterRound = 3;
constexpr double kUnreached = 0.02;  // edge lengths
constexpr int kSweepsPerRound = 2;
// Cells below this are improved between the rounds of projection.
constexpr double kRoundTarget = 0.7;

// Sweeps until hardly anything moves, at most.
constexpr int kMinimumSweeps = 12;
constexpr int kAverageSweeps = 6;
constexpr double kMinimumTarget = 0.6;
constexpr double kAverageTarget = 0.995;
// Sweeps end when less than this share of the vertices still moves.
constexpr double kIdleShare = 0.002;

class Placer {
 public:
  Placer(Placement& placement, RunContext& run) : placement_(placement), run_(run) {
    for (const CellCorners& corners : placement.complex.cells) {
      hexahedron_count_ += FindCellPattern(corners)->type == PrimitiveType::kHexahedron;
    }
  }

  absl::Status Run() {
    for (size_t round = 0; round < kProjectionFloors.size(); ++round) {
      absl::Status status = ProjectToHull(placement_, kProjectionFloors[round], run_);
      if (!status.ok()) return status;
      const SweepRules rules{QualityAim::kMinimum, kRoundTarget, kRoundTarget};
      status = Sweep(rules, kSweepsPerRound);
      if (!status.ok()) return status;
      if (round == kWeakenAfterRound) WeakenUnreached(placement_, kUnreached);
      Report(0.4 * static_cast<double>(round + 1) / kProjectionFloors.size());
    }
    absl::Status status = RaiseMinimum();
    if (!status.ok()) return status;
    Report(0.6);
    status = Sweep({QualityAim::kAverage, kAverageTarget, kMinimumTarget}, kAverageSweeps);
    if (!status.ok()) return status;
    Report(0.85);
    status = RaiseMinimum();
    Report(1.0);
    return status;
  }

 private:
  absl::Status RaiseMinimum() {
    return Sweep({QualityAim::kMinimum, kMinimumTarget, kMinimumTarget}, kMinimumSweeps);
  }

  absl::Status Sweep(const SweepRules& rules, int sweep_count) {
    const int64_t vertex_count = static_cast<int64_t>(placement_.complex.vertices.size());
    SweepMemory memory = StartSweeps(vertex_count);
    for (int sweep = 0; sweep < sweep_count; ++sweep) {
      const absl::StatusOr<int64_t> moved = SweepQuality(placement_, rules, memory, run_);
      if (!moved.ok()) return moved.status();
      if (static_cast<double>(*moved) <= kIdleShare * static_cast<double>(vertex_count)) {
        if (rules.aim == QualityAim::kAverage || *moved == 0) break;
      }
    }
    return absl::OkStatus();
  }

  void Report(double fraction) {
    Progress progress = run_.progress();
    progress.stage_fraction = fraction;
    progress.cell_count = static_cast<int64_t>(placement_.complex.cells.size());
    progress.hexahedron_count = hexahedron_count_;
    progress.min_scaled_jacobian = SummarizeQuality(placement_.complex).minimum;
    run_.Report(progress);
  }

  Placement& placement_;
  RunContext& run_;
  int64_t hexahedron_count_ = 0;
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

absl::StatusOr<CellComplex> PlaceVertices(CellComplex complex, const Hull& hull,
                                          const MeshingParams& /*params*/, RunContext& run) {
  absl::Status status = CheckCells(complex);
  if (!status.ok()) return status;
  if (complex.cells.empty()) return complex;
  // Judge the maps that the output will have.
  for (CellCorners& corners : complex.cells) corners = AsListedInFigure2(corners);
  const HullFeatures features(hull);
  VertexNeighbourhoods neighbourhoods = FindNeighbourhoods(complex);
  VertexConstraints constraints = AssignConstraints(complex, neighbourhoods, features);
  Placement placement{complex, features, std::move(neighbourhoods), std::move(constraints)};
  status = Placer(placement, run).Run();
  if (!status.ok()) return status;
  return complex;
}

}  // namespace amhex
