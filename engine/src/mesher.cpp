#include "amhex/mesher.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "backends.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "input/build_hull.h"
#include "input/guidance_checks.h"
#include "input/sample_hull.h"
#include "judge.h"
#include "optimize/report_cells.h"
#include "output/finalize_mesh.h"
#include "place_best_trial.h"
#include "stage.h"
#include "tell_thin.h"
#include "trials.h"
#include "volume_mesher.h"

namespace amhex {
namespace {

absl::StatusOr<Hull> BuildGuidedHull(const InputHull& input, const Guidance& guidance,
                                     const MeshingParams& params, RunContext& run) {
  AMHEX_RETURN_IF_ERROR(CheckGuidance(guidance, params));
  AMHEX_ASSIGN_OR_RETURN(Hull hull, BuildHull(input, params, run));
  ApplyGuidance(guidance, &hull);
  return hull;
}

// What ran where. A run that the device had no room for may be repeated on the CPU.
BackendChoice Settle(BackendChoice choice, const std::vector<std::string>& device_notes) {
  for (const std::string& note : device_notes) absl::StrAppend(&choice.note, "; ", note);
  if (!device_notes.empty()) choice.backend = Backend::kCpu;
  return choice;
}

MeshingParams Resolve(const MeshingParams& params, const Hull& hull, Backend backend) {
  MeshingParams effective = params;
  effective.sizing.cell_count = 0;
  effective.sizing.edge_length = hull.frame.scale;
  effective.sizing.trial_count = PlanTrials(hull, params).started.most;
  effective.run.backend = backend;
  return effective;
}

// All stages after check_input.
absl::StatusOr<MeshingResult> MeshHull(const Hull& hull, const BackendChoice& backend,
                                       const MeshingParams& params, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(const HullSamples samples, GuardStage(run, Stage::kSampleHull, [&] {
                           return SampleHull(hull, params.run.backend, run);
                         }));
  const TrialPlan plan = PlanTrials(hull, params);
  AMHEX_ASSIGN_OR_RETURN(const AssembledTrials assembled,
                         AssembleTrials(hull, samples, plan, params, run));
  AMHEX_ASSIGN_OR_RETURN(ClosedTrials closed,
                         CloseTrials(assembled.complexes, hull, plan, params, run));
  SpareTrial spare;
  const bool has_made_usual = assembled.complexes.size() == static_cast<size_t>(plan.started.usual);
  if (plan.has_spare && has_made_usual) {
    spare = [&] { return AssembleSpare(hull, samples, plan, params, run); };
  }
  AMHEX_ASSIGN_OR_RETURN(
      const PlacedTrial placed,
      PlaceBestTrial(assembled.complexes, std::move(closed), hull, params, run, spare));
  AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(params.run.backend));
  AMHEX_ASSIGN_OR_RETURN(MeshingResult result, GuardStage(run, Stage::kValidate, [&] {
                           ReportCells(placed.complex, run);  // the last trial need not be the best
                           const StopPoll poll(run);
                           return Judge(FinalizeMesh(placed.complex, hull.frame, poll), hull, poll,
                                        &device);
                         }));
  result.stages = run.stage_reports();
  std::vector<std::string> notes = hull.device_notes;
  notes.insert(notes.end(), samples.device_notes.begin(), samples.device_notes.end());
  notes.insert(notes.end(), assembled.device_notes.begin(), assembled.device_notes.end());
  notes.insert(notes.end(), placed.device_notes.begin(), placed.device_notes.end());
  notes.insert(notes.end(), device.notes().begin(), device.notes().end());
  const BackendChoice settled = Settle(backend, notes);
  result.effective_params = Resolve(params, hull, settled.backend);
  result.backend_note = settled.note;
  return result;
}

absl::StatusOr<MeshingResult> Run(const InputHull& input, const Guidance& guidance,
                                  const MeshingParams& params, RunContext& run) {
  AMHEX_RETURN_IF_ERROR(Validate(params));
  const size_t threads = params.run.thread_count > 0
                             ? static_cast<size_t>(params.run.thread_count)
                             : static_cast<size_t>(oneapi::tbb::info::default_concurrency());
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                          threads);
  AMHEX_ASSIGN_OR_RETURN(const BackendChoice backend, ChooseBackend(params.run.backend));

  const auto* volume = std::get_if<VolumeMesh>(&input);
  if (volume != nullptr && params.input.volume_use != VolumeUse::kHull) {
    return MeshVolume(*volume, guidance, params, run);
  }
  AMHEX_ASSIGN_OR_RETURN(const Hull hull, GuardStage(run, Stage::kCheckInput, [&] {
                           return BuildGuidedHull(input, guidance, params, run);
                         }));
  absl::StatusOr<MeshingResult> result = MeshHull(hull, backend, params, run);
  if (!result.ok()) return TellThinWalls(result.status(), hull, run);
  return result;
}

}  // namespace

absl::StatusOr<MeshingResult> Mesh(const InputHull& hull, const MeshingParams& params,
                                   RunContext& run) {
  return Run(hull, Guidance(), params, run);
}

absl::StatusOr<MeshingResult> Mesh(const MeshingInput& input, const MeshingParams& params,
                                   RunContext& run) {
  return Run(input.hull, input.guidance, params, run);
}

}  // namespace amhex
