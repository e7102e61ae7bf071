#include "trials.h"

#include <algorithm>
#include <optional>
#include <type_traits>
#include <utility>

#include "assembly/assemble.h"
#include "base/status_macros.h"
#include "closure/close_complex.h"
#include "closure/rank_complexes.h"
#include "cuda/device_use.h"
#include "fields/field_sites.h"
#include "geometry/match_and_merge.h"
#include "input/site_grid.h"
#include "optimize/improve_mesh.h"
#include "optimize/raise_quality.h"
#include "output/finalize_mesh.h"
#include "output/validate.h"
#include "relax/relaxation.h"
#include "stage.h"
#include "topology/extract_topology.h"

namespace amhex {
namespace {

// Trials pay where few cells lie across the solid, which then fit well or badly as a whole, and
// where they cost little. Up to so many wanted cells:
struct TrialsBySize {
  double most_cells;
  int started;
};
constexpr TrialsBySize kTrialsBySize[] = {{4e3, 10}, {2e4, 3}};
// Placing costs most: from so many trials on, a second one is placed if the first is poor.
constexpr int kTrialsForSecondPlacing = 4;

// A mesh whose worst cell is this good ends the search. Below, each tenth counts as much as five
// hundredths of the average.
constexpr double kGoodMinimum = 0.3;
constexpr double kMinimumWeight = 0.5;

// What comes next is one of `count` equal parts of the stage.
void SetPart(size_t index, size_t count, RunContext& run) {
  const auto of = static_cast<double>(count);
  run.SetStagePart(static_cast<double>(index) / of, static_cast<double>(index + 1) / of);
}

// One stage of every trial: step(input) for each of `inputs`, which it may consume.
template <class Input, class Step>
auto RunTrials(RunContext& run, Stage stage, std::vector<Input>& inputs, const Step& step) {
  using Output = typename std::invoke_result_t<Step, Input&>::value_type;
  return GuardStage(run, stage, [&]() -> absl::StatusOr<std::vector<Output>> {
    std::vector<Output> outputs;
    for (Input& input : inputs) {
      SetPart(outputs.size(), inputs.size(), run);
      AMHEX_ASSIGN_OR_RETURN(Output output, step(input));
      outputs.push_back(std::move(output));
    }
    return outputs;
  });
}

// A filling that breaks the law once its vertices are placed is not the only one: another is
// tried before the run gives up.
constexpr int kMaxFillings = 3;

// What all trials are placed with.
struct Placing {
  const Hull& hull;
  const MeshingParams& params;
  DeviceUse& device;
};

absl::StatusOr<CellComplex> ImproveUntilValid(const CellComplex& assembled, CellComplex closed,
                                              const Placing& placing, RunContext& run) {
  const Hull& hull = placing.hull;
  const MeshingParams& params = placing.params;
  for (int attempt = 1;; ++attempt) {
    AMHEX_ASSIGN_OR_RETURN(CellComplex improved,
                           ImproveMesh(std::move(closed), hull, params, run, &placing.device));
    if (attempt == kMaxFillings) return improved;
    const StopPoll poll(run);
    if (ValidateMesh(FinalizeMesh(improved, hull.frame, poll), poll).valid()) return improved;
    AMHEX_ASSIGN_OR_RETURN(closed, CloseComplex(assembled, hull, params, run, attempt));
  }
}

// Less is better.
double LossOf(const CellComplex& placed, const Hull& hull, double minimum) {
  const QualitySummary quality = SummarizeQuality(placed);
  return 1 - quality.average + kMinimumWeight * std::max(0.0, kGoodMinimum - minimum) +
         DeviationLoss(static_cast<double>(placed.cells.size()), hull);
}

absl::StatusOr<std::vector<Sites>> Populate(const Hull& hull, const HullSamples& samples,
                                            const TrialPlan& plan, const MeshingParams& params,
                                            RunContext& run) {
  if (params.relaxation.initialization == Initialization::kField) {
    return PopulateFromFields(hull, samples, plan.started, params.run.backend, run);
  }
  AMHEX_ASSIGN_OR_RETURN(Sites sites, PopulateGrid(hull, samples, params, run));
  std::vector<Sites> only;
  only.push_back(std::move(sites));
  return only;
}

// Those of all trials, each once.
std::vector<std::string> DeviceNotes(const std::vector<Sites>& trials) {
  std::vector<std::string> notes;
  for (const Sites& trial : trials) {
    for (const std::string& note : trial.device_notes) {
      if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
    }
  }
  return notes;
}

}  // namespace

int CountOfTrials(double cell_count, const MeshingParams& params) {
  if (params.relaxation.initialization != Initialization::kField) return 1;
  if (params.sizing.trial_count > 0) return std::min<int>(params.sizing.trial_count, kMaxTrials);
  int count = 1;
  for (const TrialsBySize& by_size : kTrialsBySize) {
    if (cell_count <= by_size.most_cells) count = std::max(count, by_size.started);
  }
  return count;
}

TrialPlan PlanTrials(const Hull& hull, const MeshingParams& params) {
  TrialPlan plan;
  plan.started = CountOfTrials(hull.volume, params);
  plan.closed = (plan.started + 1) / 2;
  plan.placed = plan.started >= kTrialsForSecondPlacing ? 2 : 1;
  return plan;
}

absl::StatusOr<AssembledTrials> AssembleTrials(const Hull& hull, const HullSamples& samples,
                                               const TrialPlan& plan, const MeshingParams& params,
                                               RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(std::vector<Sites> sites, GuardStage(run, Stage::kPopulate, [&] {
                           return Populate(hull, samples, plan, params, run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(std::vector<Sites> relaxed,
                         RunTrials(run, Stage::kRelax, sites, [&](Sites& trial) {
                           return RelaxSites(hull, samples, std::move(trial), params, run);
                         }));
  std::vector<std::string> notes = DeviceNotes(relaxed);
  AMHEX_ASSIGN_OR_RETURN(std::vector<MergedCubes> cubes,
                         RunTrials(run, Stage::kMatchAndMerge, relaxed, [&](const Sites& trial) {
                           return MatchAndMerge(trial, hull, params, run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(
      std::vector<PrimitiveTable> primitives,
      RunTrials(run, Stage::kExtractTopology, cubes,
                [&](const MergedCubes& trial) { return ExtractTopology(trial, params, run); }));
  AssembledTrials assembled;
  auto table = primitives.begin();
  AMHEX_ASSIGN_OR_RETURN(assembled.complexes,
                         RunTrials(run, Stage::kAssemble, cubes, [&](const MergedCubes& trial) {
                           return AssembleCells(*table++, trial, params, run);
                         }));
  assembled.device_notes = std::move(notes);
  return assembled;
}

absl::StatusOr<std::vector<ClosedTrial>> CloseTrials(const std::vector<CellComplex>& assemblies,
                                                     const Hull& hull, const TrialPlan& plan,
                                                     const MeshingParams& params, RunContext& run) {
  return GuardStage(run, Stage::kClose, [&]() -> absl::StatusOr<std::vector<ClosedTrial>> {
    AMHEX_ASSIGN_OR_RETURN(const std::vector<size_t> order, RankComplexes(assemblies, hull, run));
    std::vector<size_t> sources;
    std::vector<CellComplex> complexes;
    absl::Status first_error;
    for (const size_t i : order) {
      if (complexes.size() == static_cast<size_t>(plan.closed)) break;
      SetPart(complexes.size(), static_cast<size_t>(plan.closed), run);
      absl::StatusOr<CellComplex> closed = CloseComplex(assemblies[i], hull, params, run);
      if (absl::Status stopped = run.CheckStop(); !stopped.ok()) return stopped;
      first_error.Update(closed.status());
      if (!closed.ok()) continue;
      sources.push_back(i);
      complexes.push_back(*std::move(closed));
    }
    if (complexes.empty()) return first_error;
    AMHEX_ASSIGN_OR_RETURN(const std::vector<size_t> best, RankComplexes(complexes, hull, run));
    std::vector<ClosedTrial> trials;
    for (const size_t i : best) trials.push_back({sources[i], std::move(complexes[i])});
    return trials;
  });
}

absl::StatusOr<PlacedTrial> PlaceBestTrial(const std::vector<CellComplex>& assemblies,
                                           std::vector<ClosedTrial> closed, const Hull& hull,
                                           const TrialPlan& plan, const MeshingParams& params,
                                           RunContext& run) {
  return GuardStage(run, Stage::kPlaceVertices, [&]() -> absl::StatusOr<PlacedTrial> {
    AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(params.run.backend));
    const Placing placing{hull, params, device};
    std::optional<CellComplex> best;
    double least = 0;
    const size_t count = std::min(closed.size(), static_cast<size_t>(plan.placed));
    for (size_t i = 0; i < count; ++i) {
      SetPart(i, count, run);
      AMHEX_ASSIGN_OR_RETURN(CellComplex placed,
                             ImproveUntilValid(assemblies[closed[i].assembly],
                                               std::move(closed[i].complex), placing, run));
      const double minimum = SummarizeQuality(placed).minimum;
      const double loss = LossOf(placed, hull, minimum);
      if (!best.has_value() || loss < least) {
        best = std::move(placed);
        least = loss;
      }
      if (minimum >= kGoodMinimum) break;
    }
    return PlacedTrial{*std::move(best), device.notes()};
  });
}

}  // namespace amhex
