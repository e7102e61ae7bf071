#include "trials.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <numeric>
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
#include "optimize/draw_rest.h"
#include "optimize/follow_hull.h"
#include "optimize/improve_mesh.h"
#include "optimize/lengthen_edges.h"
#include "optimize/raise_average.h"
#include "optimize/raise_quality.h"
#include "optimize/refill_places.h"
#include "optimize/report_cells.h"
#include "output/finalize_mesh.h"
#include "output/validate.h"
#include "place_candidates.h"
#include "placed_loss.h"
#include "relax/relaxation.h"
#include "split_where_paid.h"
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
constexpr TrialsBySize kTrialsBySize[] = {{2e3, 12}, {4e3, 9}, {1e5, 2}};
// Of so many trials the best one is taken where the first keeps a poor cell, and the next ones,
// too; of more where a part of the solid is lost.
constexpr size_t kLeastChoice = 3;
constexpr size_t kLeastChoiceOfLost = 5;

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

// A placed trial with its poor places refilled, its average raised and its boundary drawn to the
// hull, where `is_followed` does not say that both have been done before; with more vertices
// where it stays too far away, and without edges of no length.
absl::StatusOr<CellComplex> RefillUntilValid(const CellComplex& assembled, CellComplex placed,
                                             bool is_followed, const Improvement& with,
                                             RunContext& run) {
  for (int attempt = 1;; ++attempt, is_followed = false) {
    AMHEX_ASSIGN_OR_RETURN(CellComplex refilled,
                           RefillPlaces(placed, with.hull, with.features, with.params, run));
    if (!is_followed) {
      AMHEX_ASSIGN_OR_RETURN(refilled,
                             RaiseAverage(std::move(refilled), with.features, run, with.device));
    }
    if (!is_followed || refilled.cells != placed.cells || refilled.vertices != placed.vertices) {
      AMHEX_ASSIGN_OR_RETURN(refilled,
                             FollowHull(std::move(refilled), with.hull, with.features, run));
    }
    AMHEX_ASSIGN_OR_RETURN(refilled,
                           SplitWherePaid(std::move(refilled), with, kMendableMinimum, run));
    AMHEX_ASSIGN_OR_RETURN(refilled, DrawRest(std::move(refilled), with.hull, with.features, run));
    AMHEX_ASSIGN_OR_RETURN(refilled,
                           LengthenEdges(std::move(refilled), with.hull, with.features, run));
    if (attempt == kMaxFillings) return refilled;
    const StopPoll poll(run);
    if (ValidateMesh(FinalizeMesh(refilled, with.hull.frame, poll), poll, with.device).valid()) {
      return refilled;
    }
    AMHEX_ASSIGN_OR_RETURN(placed, CloseComplex(assembled, with.hull, with.params, run, attempt));
    AMHEX_ASSIGN_OR_RETURN(placed, ImproveMesh(std::move(placed), with, run));
  }
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

// The first `count` of the ranked ones, in their order. Several are closed side by side, and a
// watcher then sees whole trials.
std::vector<absl::StatusOr<CellComplex>> CloseFirst(const std::vector<const CellComplex*>& first,
                                                    const Hull& hull, const MeshingParams& params,
                                                    RunContext& run) {
  std::vector<absl::StatusOr<CellComplex>> closed(first.size());
  if (first.size() == 1) {
    closed[0] = CloseComplex(*first[0], hull, params, run);
    return closed;
  }
  std::mutex mutex;  // of the report
  size_t done = 0;
  oneapi::tbb::parallel_for(size_t{0}, first.size(), [&](size_t i) {
    closed[i] = CloseUnwatched(*first[i], hull, params, run);
    const CellComplex& cells = closed[i].ok() ? *closed[i] : *first[i];
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

// Adds those of all trials, each once.
template <class Trial>
void AddDeviceNotes(const std::vector<Trial>& trials, std::vector<std::string>& notes) {
  for (const Trial& trial : trials) {
    for (const std::string& note : trial.device_notes) {
      if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
    }
  }
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
  plan.closed = std::min(plan.started, LittleWorkOf(hull).closed);
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

absl::StatusOr<ClosedTrials> CloseTrials(const std::vector<CellComplex>& assemblies,
                                         const Hull& hull, const TrialPlan& plan,
                                         const MeshingParams& params, RunContext& run) {
  return GuardStage(run, Stage::kClose, [&]() -> absl::StatusOr<ClosedTrials> {
    AMHEX_ASSIGN_OR_RETURN(const std::vector<RankedComplex> ranked,
                           RankComplexes(assemblies, hull, run));
    std::vector<size_t> sources;
    std::vector<CellComplex> complexes;
    absl::Status first_error;
    size_t count = CountToClose(ranked, plan, hull), begin = 0;
    for (; begin < ranked.size() && complexes.empty(); begin += count, count = 1) {
      std::vector<const CellComplex*> chosen;
      for (size_t i = begin; i < begin + count; ++i) chosen.push_back(&assemblies[ranked[i].index]);
      std::vector<absl::StatusOr<CellComplex>> closed = CloseFirst(chosen, hull, params, run);
      if (absl::Status stopped = run.CheckStop(); !stopped.ok()) return stopped;
      for (size_t i = 0; i < count; ++i) {
        first_error.Update(closed[i].status());
        if (!closed[i].ok()) continue;
        sources.push_back(ranked[begin + i].index);
        complexes.push_back(*std::move(closed[i]));
      }
    }
    if (complexes.empty()) return first_error;
    AMHEX_ASSIGN_OR_RETURN(const std::vector<RankedComplex> best,
                           RankComplexes(complexes, hull, run));
    ClosedTrials trials;
    trials.closed.reserve(best.size());
    for (const RankedComplex& next : best) {
      trials.closed.push_back({sources[next.index], std::move(complexes[next.index])});
    }
    for (size_t i = begin; i < ranked.size(); ++i) trials.waiting.push_back(ranked[i].index);
    return trials;
  });
}

absl::StatusOr<PlacedTrial> PlaceBestTrial(const std::vector<CellComplex>& assemblies,
                                           ClosedTrials trials, const Hull& hull,
                                           const MeshingParams& params, RunContext& run) {
  return GuardStage(run, Stage::kPlaceVertices, [&]() -> absl::StatusOr<PlacedTrial> {
    AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(params.run.backend));
    const HullFeatures features(hull, StopPoll(run));
    const Improvement with{hull, features, params, &device};
    std::vector<ClosedTrial>& closed = trials.closed;
    AMHEX_ASSIGN_OR_RETURN(std::vector<PlacedCandidate> placed, PlaceCandidates(closed, with, run));
    // Where a poor cell remains, or a part is lost, and nothing was placed beside it, the next ones
    // have their turn.
    const size_t trial_count = closed.size() + trials.waiting.size();
    const auto choice_of = [&](size_t least) {
      return std::max(placed.size(), std::min(trial_count, least));
    };
    const bool has_choice = choice_of(kLeastChoice) > 1;
    std::optional<CellComplex> best;
    double least = 0;
    bool is_lost = false;  // something in the best one
    for (size_t i = 0; i < choice_of(is_lost ? kLeastChoiceOfLost : kLeastChoice); ++i) {
      if (i == placed.size()) {
        if (i == closed.size()) {
          const size_t next = trials.waiting.front();
          trials.waiting.erase(trials.waiting.begin());
          absl::StatusOr<CellComplex> late = CloseComplex(assemblies[next], hull, params, run);
          AMHEX_RETURN_IF_ERROR(run.CheckStop());
          if (!late.ok()) break;  // there is a mesh already
          closed.push_back({next, *std::move(late)});
        }
        AMHEX_ASSIGN_OR_RETURN(CellComplex next,
                               ImproveMesh(std::move(closed[i].complex), with, run));
        placed.push_back({closed[i].assembly, std::move(next), false, {}});
      }
      AMHEX_ASSIGN_OR_RETURN(
          CellComplex refilled,
          RefillUntilValid(assemblies[placed[i].assembly], std::move(placed[i].complex),
                           placed[i].is_followed, with, run));
      PlacedLoss loss;
      if (has_choice) loss = LossOf(refilled, with, kGoodMinimum, StopPoll(run));
      const bool is_good = loss.lost == 0 && SummarizeQuality(refilled, StopPoll(run)).minimum >=
                                                 params.assembly.min_quality;
      if (!best.has_value() || loss.total() < least) {
        best = std::move(refilled);
        least = loss.total();
        is_lost = loss.lost > 0;
      }
      if (is_good) break;
    }
    return PlacedTrial{*std::move(best), device.notes()};
  });
}

}  // namespace amhex
