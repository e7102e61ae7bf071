#include "closure/improve_closure.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "base/status_macros.h"
#include "closure/cell_qualities.h"
#include "closure/star_fill.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// Losing a hexahedron to a repair must pay more than it does while a cavity is open, and quality is
// what repairs are for.
constexpr double kRepairHexahedronLost = 1.6;
constexpr double kRepairOtherRemoved = -1.1;
constexpr FillWeights kJoinWeights{1.0, -1.1};
// A replacement must gain at least this, in cells.
constexpr double kMinRepairGain = 0.3;
constexpr double kMinJoinGain = 0.5;
constexpr double kMinJoinQuality = 0.25;
constexpr size_t kMaxSeedCells = 60;
constexpr int kJoinDepth = 3;
// Two stars whose walls are this far from having a common kernel do not become one by growing.
constexpr double kMinJoinDepth = -0.12;
constexpr int kMaxJoinRounds = 3;

class Improver {
 public:
  Improver(const CellComplex& complex, const Hull& hull, const RunContext& run)
      : hull_(hull),
        run_(run),
        mesh_(complex, StopPoll(run)),
        cells_at_(mesh_.CellsAtVertices(StopPoll(run))) {
    limits_.forbid_cavities = true;
    limits_.run = &run;
  }

  // Worst first.
  void Repair(const RepairEffort& effort) {
    std::vector<std::pair<double, int>> poor;
    const std::vector<double> qualities = CellQualities(mesh_, effort.only, StopPoll(run_));
    for (int cell = 0; cell < mesh_.cell_slots(); ++cell) {
      if (qualities[cell] < effort.quality) poor.emplace_back(qualities[cell], cell);
    }
    std::sort(poor.begin(), poor.end());
    limits_.depth = effort.depth;
    limits_.beam_width = effort.beam_width;
    limits_.enough_quality = std::max(limits_.enough_quality, effort.good_quality);
    repair_weights_ = {kRepairHexahedronLost, kRepairOtherRemoved, effort.poor_quality,
                       effort.good_quality};
    limits_.min_seed_depth = GrowthLimits{}.min_seed_depth;
    for (const auto& [q, cell] : poor) {
      if (run_.ShouldStop()) break;
      if (mesh_.alive(cell)) RepairCell(cell, q);
    }
  }

  void JoinStars() {
    limits_.depth = kJoinDepth;
    limits_.beam_width = 3;
    limits_.min_seed_depth = kMinJoinDepth;
    std::set<std::pair<int, int>> tried;
    for (int round = 0; round < kMaxJoinRounds; ++round) {
      std::set<int> touched;
      bool joined = false;
      for (const auto& [a, b] : AdjacentStars()) {
        if (run_.ShouldStop()) return;
        if (touched.contains(a) || touched.contains(b) || !tried.insert({a, b}).second) continue;
        if (!JoinPair(a, b)) continue;
        joined = true;
        touched.insert(a);
        touched.insert(b);
      }
      if (!joined) break;
    }
  }

  CellComplex Result() const { return mesh_.ToComplex(StopPoll(run_)); }

 private:
  // The living cells at a vertex, ascending.
  std::vector<int> LivingCellsAt(int32_t v) {
    auto& cells = cells_at_[v];
    std::erase_if(cells, [&](int cell) { return !mesh_.alive(cell); });
    return cells;
  }

  // An apex is a vertex that belongs to pyramids and tetrahedra alone.
  bool IsApex(int32_t v) {
    const auto cells = LivingCellsAt(v);
    return !cells.empty() && std::all_of(cells.begin(), cells.end(), [&](int cell) {
      const PrimitiveType type = mesh_.type(cell);
      return type == PrimitiveType::kPyramid || type == PrimitiveType::kTetrahedron;
    });
  }

  double WorstQuality(const std::vector<int>& cells) const {
    double worst = 1;
    for (const int cell : cells) {
      worst = std::min(worst, CellQuality(mesh_.corners(cell), mesh_.vertices()));
    }
    return worst;
  }

  void Apply(const StarFilling& filling) {
    const int before = mesh_.cell_slots();
    ApplyStar(filling, &mesh_);
    cells_at_.resize(mesh_.vertices().size());
    for (int cell = before; cell < mesh_.cell_slots(); ++cell) {
      for (const int32_t v : VerticesOf(mesh_.corners(cell))) cells_at_[v].push_back(cell);
    }
  }

  void RepairCell(int cell, double quality) {
    std::vector<Region> seeds(1);
    seeds[0].cells = {cell};
    std::vector<std::vector<int>> stars;
    for (const int32_t v : VerticesOf(mesh_.corners(cell))) {
      if (!IsApex(v)) continue;
      Region star;
      star.cells = LivingCellsAt(v);
      if (star.cells.size() > kMaxSeedCells) continue;
      if (grown_in_vain_.contains(star.cells)) return;
      stars.push_back(star.cells);
      seeds.push_back(std::move(star));
    }
    const double cost_to_beat = QualityPenalty(repair_weights_, quality) - kMinRepairGain;
    const auto filling = GrowStar(mesh_, hull_, no_cavities_, repair_weights_, limits_,
                                  std::move(seeds), cost_to_beat);
    if (!filling || filling->quality <= quality) {
      grown_in_vain_.insert(stars.begin(), stars.end());
      return;
    }
    Apply(*filling);
  }

  // Pairs of apexes whose stars share faces, those that share most first.
  std::vector<std::pair<int, int>> AdjacentStars() {
    std::vector<int> apex_of(mesh_.cell_slots(), -1);
    for (int32_t v = 0; v < static_cast<int32_t>(cells_at_.size()); ++v) {
      if (!IsApex(v)) continue;
      for (const int cell : cells_at_[v]) apex_of[cell] = std::max(apex_of[cell], v);
    }
    std::vector<std::pair<int, int>> pairs;
    for (int cell = 0; cell < mesh_.cell_slots(); ++cell) {
      if (!mesh_.alive(cell) || apex_of[cell] < 0) continue;
      for (const CellFace& face : FacesOf(mesh_.corners(cell))) {
        const int32_t behind = mesh_.Across(face);
        if (behind > cell && apex_of[behind] >= 0 && apex_of[behind] != apex_of[cell]) {
          pairs.emplace_back(std::minmax(apex_of[cell], apex_of[behind]));
        }
      }
    }
    std::sort(pairs.begin(), pairs.end());
    std::vector<std::tuple<int, int, int>> counted;
    for (size_t i = 0; i < pairs.size();) {
      size_t j = i;
      while (j < pairs.size() && pairs[j] == pairs[i]) ++j;
      counted.emplace_back(-static_cast<int>(j - i), pairs[i].first, pairs[i].second);
      i = j;
    }
    std::sort(counted.begin(), counted.end());
    std::vector<std::pair<int, int>> result;
    result.reserve(counted.size());
    for (const auto& [count, a, b] : counted) result.emplace_back(a, b);
    return result;
  }

  bool JoinPair(int a, int b) {
    Region both;
    both.cells = LivingCellsAt(a);
    for (const int cell : LivingCellsAt(b)) both.cells.push_back(cell);
    std::sort(both.cells.begin(), both.cells.end());
    both.cells.erase(std::unique(both.cells.begin(), both.cells.end()), both.cells.end());
    if (both.cells.empty() || both.cells.size() > kMaxSeedCells) return false;
    const double worst = WorstQuality(both.cells);
    const auto filling = GrowStar(mesh_, hull_, no_cavities_, kJoinWeights, limits_, {both},
                                  QualityPenalty(kJoinWeights, worst) - kMinJoinGain);
    if (!filling || filling->quality < std::min(kMinJoinQuality, worst)) return false;
    Apply(*filling);
    return true;
  }

  const Hull& hull_;
  const RunContext& run_;
  WorkingMesh mesh_;
  std::vector<std::vector<int>> cells_at_;
  // Stars (their cells) that grew to no replacement for the poorest of their cells, which asks for
  // least: the others are not worth a try.
  std::set<std::vector<int>> grown_in_vain_;
  const Cavities no_cavities_;
  GrowthLimits limits_;
  FillWeights repair_weights_;
};

}  // namespace

absl::StatusOr<CellComplex> JoinStars(const CellComplex& complex, const Hull& hull,
                                      const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  Improver improver(complex, hull, run);
  improver.JoinStars();
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  return improver.Result();
}

absl::StatusOr<CellComplex> RepairCells(const CellComplex& complex, const Hull& hull,
                                        const RepairEffort& effort, const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  Improver improver(complex, hull, run);
  improver.Repair(effort);
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  return improver.Result();
}

}  // namespace amhex
