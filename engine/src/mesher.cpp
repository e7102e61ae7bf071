#include "amhex/mesher.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"
#include "assembly/assemble.h"
#include "backends.h"
#include "base/status_macros.h"
#include "closure/close_complex.h"
#include "fields/field_sites.h"
#include "geometry/match_and_merge.h"
#include "input/build_hull.h"
#include "input/guidance_checks.h"
#include "input/sample_hull.h"
#include "input/site_grid.h"
#include "judge.h"
#include "optimize/improve_mesh.h"
#include "output/finalize_mesh.h"
#include "output/validate.h"
#include "relax/relaxation.h"
#include "stage.h"
#include "topology/extract_topology.h"
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

absl::StatusOr<Sites> Populate(const Hull& hull, const HullSamples& samples,
                               const MeshingParams& params, RunContext& run) {
  if (params.relaxation.initialization == Initialization::kField) {
    return PopulateFromFields(hull, samples, params, run);
  }
  return PopulateGrid(hull, samples, params, run);
}

// A filling that breaks the law once its vertices are placed is not the only one: another is
// tried before the run gives up.
constexpr int kMaxFillings = 3;

absl::StatusOr<CellComplex> ImproveUntilValid(const CellComplex& assembled, CellComplex closed,
                                              const Hull& hull, const MeshingParams& params,
                                              RunContext& run) {
  for (int attempt = 1;; ++attempt) {
    AMHEX_ASSIGN_OR_RETURN(CellComplex improved, ImproveMesh(std::move(closed), hull, params, run));
    if (attempt == kMaxFillings) return improved;
    const StopPoll poll(run);
    if (ValidateMesh(FinalizeMesh(improved, hull.frame, poll), poll).valid()) return improved;
    AMHEX_ASSIGN_OR_RETURN(closed, CloseComplex(assembled, hull, params, run, attempt));
  }
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
  effective.run.backend = backend;
  return effective;
}

absl::StatusOr<MeshingResult> Run(const InputHull& input, const Guidance& guidance,
                                  const MeshingParams& params, RunContext& run) {
  AMHEX_RETURN_IF_ERROR(Validate(params));
  AMHEX_ASSIGN_OR_RETURN(const BackendChoice backend, ChooseBackend(params.run.backend));
  const size_t threads = params.run.thread_count > 0
                             ? static_cast<size_t>(params.run.thread_count)
                             : static_cast<size_t>(oneapi::tbb::info::default_concurrency());
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                          threads);

  const auto* volume = std::get_if<VolumeMesh>(&input);
  if (volume != nullptr && params.input.volume_use != VolumeUse::kHull) {
    return MeshVolume(*volume, guidance, params, run);
  }
  AMHEX_ASSIGN_OR_RETURN(const Hull hull, GuardStage(run, Stage::kCheckInput, [&] {
                           return BuildGuidedHull(input, guidance, params, run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(const HullSamples samples, GuardStage(run, Stage::kSampleHull, [&] {
                           return SampleHull(hull, params.input, run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(Sites sites, GuardStage(run, Stage::kPopulate, [&] {
                           return Populate(hull, samples, params, run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(const Sites relaxed, GuardStage(run, Stage::kRelax, [&] {
                           return RelaxSites(hull, samples, std::move(sites), params, run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(const MergedCubes cubes, GuardStage(run, Stage::kMatchAndMerge, [&] {
                           return MatchAndMerge(relaxed, hull, params, run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(const PrimitiveTable primitives,
                         GuardStage(run, Stage::kExtractTopology,
                                    [&] { return ExtractTopology(cubes, params, run); }));
  AMHEX_ASSIGN_OR_RETURN(const CellComplex assembled, GuardStage(run, Stage::kAssemble, [&] {
                           return AssembleCells(primitives, cubes, params, run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(CellComplex closed, GuardStage(run, Stage::kClose, [&] {
                           return CloseComplex(assembled, hull, params, run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(const CellComplex improved, GuardStage(run, Stage::kPlaceVertices, [&] {
                           return ImproveUntilValid(assembled, std::move(closed), hull, params,
                                                    run);
                         }));
  AMHEX_ASSIGN_OR_RETURN(MeshingResult result, GuardStage(run, Stage::kValidate, [&] {
                           const StopPoll poll(run);
                           return Judge(FinalizeMesh(improved, hull.frame, poll), hull, poll);
                         }));
  result.stages = run.stage_reports();
  const BackendChoice settled = Settle(backend, relaxed.device_notes);
  result.effective_params = Resolve(params, hull, settled.backend);
  result.backend_note = settled.note;
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
