#include "trials.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>

#include "assembly/assemble.h"
#include "base/status_macros.h"
#include "closure/close_complex.h"
#include "closure/rank_complexes.h"
#include "fields/field_sites.h"
#include "geometry/match_and_merge.h"
#include "input/site_grid.h"
#include "optimize/hull_features.h"
#include "optimize/place_vertices.h"
#include "optimize/report_cells.h"
#include "place_candidates.h"
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
constexpr TrialsBySize kTrialsBySize[] = {{2e3, 12}, {4e3, 9}, {kLargeSolid, kFewTrials}};
// Of large solids, unless another number is asked for.
constexpr int kTrialsOfLarge = 2;

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

// How many of the ranked trials are closed.
size_t CountToClose(const std::vector<RankedComplex>& ranked, const TrialPlan& plan,
                    const Hull& hull) {
  size_t count = 0;
  int64_t open_faces = 0;
  for (const RankedComplex& next : ranked) {
    open_faces += next.open_faces;
    if (count >= static_cast<size_t>(plan.closed) && open_faces > LittleWorkOf(hull).open_faces) {
      break;
    }
    ++count;
  }
  return count;
}

// Moves vertices to the hull and its features, which are found when first asked for.
class VertexPlacer {
 public:
  VertexPlacer(const Hull& hull, const RunContext& run) : hull_(hull), run_(run) {}
  absl::StatusOr<CellComplex> operator()(CellComplex complex) {
    std::call_once(are_found_, [this] {
      // While others wait for them this thread must not take up another trial, which would, too.
      oneapi::tbb::this_task_arena::isolate([this] { features_.emplace(hull_, StopPoll(run_)); });
    });
    return PlacePart(std::move(complex), {}, *features_, run_, PlacementEffort::kValid);
  }

 private:
  const Hull& hull_;
  const RunContext& run_;
  std::once_flag are_found_;
  std::optional<HullFeatures> features_;
};

// The assemblies `first`, in their order. Several are closed side by side, none of
// them by the last resort, and a watcher then sees whole trials.
std::vector<absl::StatusOr<CellComplex>> CloseFirst(const std::vector<CellComplex>& assemblies,
                                                    const std::vector<size_t>& first,
                                                    const Hull& hull, const MeshingParams& params,
                                                    RunContext& run) {
  std::vector<absl::StatusOr<CellComplex>> closed(first.size());
  VertexPlacer placer(hull, run);
  const auto place = [&placer](CellComplex complex) { return placer(std::move(complex)); };
  if (first.size() == 1) {
    closed[0] = CloseComplex(assemblies[first[0]], hull, params, run, {.place = place});
    return closed;
  }
  std::mutex mutex;  // of the report
  size_t done = 0;
  oneapi::tbb::parallel_for(size_t{0}, first.size(), [&](size_t i) {
    const CellComplex& assembly = assemblies[first[i]];
    closed[i] = CloseUnwatched(assembly, hull, params, run, {.may_fail = true, .place = place});
    const CellComplex& cells = closed[i].ok() ? *closed[i] : assembly;
    const CellCounts counts = CountCells(cells);
    const std::lock_guard lock(mutex);
    Progress progress = run.progress();
    progress.cell_count = static_cast<int64_t>(cells.cells.size());
    progress.cells_by_type = counts;
    progress.stage_fraction = static_cast<double>(++done) / static_cast<double>(first.size());
    run.Report(progress);
  });
  return closed;
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

// Adds those of one trial, each once.
template <class Trial>
void AddDeviceNotesOf(const Trial& trial, std::vector<std::string>& notes) {
  for (const std::string& note : trial.device_notes) {
    if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
  }
}

template <class Trial>
void AddDeviceNotes(const std::vector<Trial>& trials, std::vector<std::string>& notes) {
  for (const Trial& trial : trials) AddDeviceNotesOf(trial, notes);
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
  const bool has_default = params.sizing.trial_count == 0;
  const bool is_large =
      hull.volume > kLargeSolid && params.relaxation.initialization == Initialization::kField;
  int& most = plan.started.most;
  most = is_large && has_default ? kTrialsOfLarge : CountOfTrials(hull.volume, params);
  plan.has_spare = is_large && most == kTrialsOfLarge;
  const bool last_if_torn = plan.has_spare || most == kFewTrials;
  plan.started.usual = last_if_torn ? most - 1 : most;
  plan.closed = std::min(most, LittleWorkOf(hull).closed);
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
                           const Sites unrelaxed = std::move(trial);  // freed as soon as it is
                           return RelaxSites(hull, samples, unrelaxed, params, run);
                         }));
  AssembledTrials assembled;
  AddDeviceNotes(relaxed, assembled.device_notes);
  AMHEX_ASSIGN_OR_RETURN(std::vector<MergedCubes> cubes,
                         RunTrials(run, Stage::kMatchAndMerge, relaxed, [&](const Sites& trial) {
                           return MatchAndMerge(trial, hull, params, run);
                         }));
  AddDeviceNotes(cubes, assembled.device_notes);
  AMHEX_ASSIGN_OR_RETURN(
      std::vector<PrimitiveTable> primitives,
      RunTrials(run, Stage::kExtractTopology, cubes,
                [&](const MergedCubes& trial) { return ExtractTopology(trial, params, run); }));
  AddDeviceNotes(primitives, assembled.device_notes);
  auto table = primitives.begin();
  AMHEX_ASSIGN_OR_RETURN(assembled.complexes,
                         RunTrials(run, Stage::kAssemble, cubes, [&](const MergedCubes& trial) {
                           return AssembleCells(*table++, trial, params, run);
                         }));
  return assembled;
}

absl::StatusOr<AssembledTrials> AssembleSpare(const Hull& hull, const HullSamples& samples,
                                              const TrialPlan& plan, const MeshingParams& params,
                                              RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(const Sites sites,
                         PopulateTrial(hull, samples, plan.started.usual, params.run.backend, run));
  AMHEX_ASSIGN_OR_RETURN(const Sites relaxed, RelaxSites(hull, samples, sites, params, run));
  AMHEX_ASSIGN_OR_RETURN(const MergedCubes cubes, MatchAndMerge(relaxed, hull, params, run));
  AMHEX_ASSIGN_OR_RETURN(const PrimitiveTable primitives, ExtractTopology(cubes, params, run));
  AMHEX_ASSIGN_OR_RETURN(CellComplex complex, AssembleCells(primitives, cubes, params, run));
  AssembledTrials assembled;
  assembled.complexes.push_back(std::move(complex));
  AddDeviceNotesOf(relaxed, assembled.device_notes);
  AddDeviceNotesOf(cubes, assembled.device_notes);
  AddDeviceNotesOf(primitives, assembled.device_notes);
  return assembled;
}

absl::StatusOr<ClosedTrials> CloseTrials(const std::vector<CellComplex>& assemblies,
                                         const Hull& hull, const TrialPlan& plan,
                                         const MeshingParams& params, RunContext& run) {
  return GuardStage(run, Stage::kClose, [&]() -> absl::StatusOr<ClosedTrials> {
    AMHEX_ASSIGN_OR_RETURN(const std::vector<RankedComplex> ranked,
                           RankComplexes(assemblies, hull, run));
    std::vector<size_t> open;  // best first
    open.reserve(ranked.size());
    for (const RankedComplex& next : ranked) open.push_back(next.index);
    std::vector<size_t> sources;
    std::vector<CellComplex> complexes;
    absl::Status first_error;
    const auto keep_closed = [&](size_t source, absl::StatusOr<CellComplex> closed) {
      first_error.Update(closed.status());
      if (!closed.ok()) return false;
      sources.push_back(source);
      complexes.push_back(*std::move(closed));
      return true;
    };
    const size_t count = CountToClose(ranked, plan, hull);
    const std::vector<size_t> first(open.begin(), open.begin() + static_cast<int64_t>(count));
    open.erase(open.begin(), open.begin() + static_cast<int64_t>(count));
    std::vector<absl::StatusOr<CellComplex>> closed =
        CloseFirst(assemblies, first, hull, params, run);
    std::vector<size_t> resisting;
    for (size_t i = 0; i < count; ++i) {
      if (!keep_closed(first[i], std::move(closed[i])) && count > 1) resisting.push_back(first[i]);
    }
    if (complexes.empty()) {
      open.insert(open.begin(), resisting.begin(), resisting.end());
      resisting.clear();
    }
    while (complexes.empty() && !open.empty()) {
      if (absl::Status stopped = run.CheckStop(); !stopped.ok()) return stopped;
      keep_closed(open.front(), CloseComplex(assemblies[open.front()], hull, params, run));
      open.erase(open.begin());
    }
    if (absl::Status stopped = run.CheckStop(); !stopped.ok()) return stopped;
    if (complexes.empty()) return first_error;
    AMHEX_ASSIGN_OR_RETURN(const std::vector<RankedComplex> best,
                           RankComplexes(complexes, hull, run));
    ClosedTrials trials;
    trials.closed.reserve(best.size());
    for (const RankedComplex& next : best) {
      trials.closed.push_back({sources[next.index], std::move(complexes[next.index])});
    }
    trials.waiting = std::move(open);
    trials.resisting = std::move(resisting);
    return trials;
  });
}

}  // namespace amhex
