#include "volume_mesher.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "closure/close_complex.h"
#include "cost_model.h"
#include "input/hull_checks.h"
#include "judge.h"
#include "optimize/report_cells.h"
#include "reassembly/break_down.h"
#include "reassembly/merge_candidates.h"
#include "reassembly/merge_cells.h"
#include "reassembly/reassemble.h"
#include "reassembly/subdivide.h"
#include "stage.h"

namespace amhex {
namespace {

absl::Status RefuseWhatCannotBeHad(const Guidance& guidance, const MeshingParams& params) {
  const char* unwanted = nullptr;
  if (params.sizing.cell_count > 0) unwanted = "sizing.cell_count";
  if (params.sizing.edge_length > 0) unwanted = "sizing.edge_length";
  if (!guidance.empty()) unwanted = "guidance";
  if (unwanted == nullptr) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      unwanted,
      " is given, but the cells of a volume mesh that is reassembled are there already; "
      "leave it out, or set input.volume_use to HULL to mesh the volume anew"));
}

absl::Status CheckMemory(const VolumeMesh& volume, const MeshingParams& params) {
  const auto cells = static_cast<int64_t>(volume.cell_faces.size());
  const int64_t bytes = ExpectedMemoryBytes(cells, cells);
  const int64_t limit = params.run.memory_limit_bytes;
  if (limit == 0 || bytes <= limit) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("about ", bytes, " bytes are needed for ", cells,
                                                   " cells, run.memory_limit_bytes is ", limit));
}

absl::StatusOr<BrokenVolume> CheckAndBreak(const VolumeMesh& volume, const Guidance& guidance,
                                           const MeshingParams& params, RunContext& run) {
  AMHEX_RETURN_IF_ERROR(CheckInput(volume));
  AMHEX_RETURN_IF_ERROR(RefuseWhatCannotBeHad(guidance, params));
  AMHEX_RETURN_IF_ERROR(CheckMemory(volume, params));
  return BreakDown(volume, run);
}

absl::Status PassOver(Stage stage, RunContext& run) {
  return GuardStage(run, stage, [] { return absl::StatusOr<bool>(true); }).status();
}

absl::StatusOr<CellComplex> Reassemble(const BrokenVolume& broken, const Hull& hull,
                                       const MeshingParams& params, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(const PieceTable pieces, GuardStage(run, Stage::kExtractTopology, [&] {
                           return FindPieces(broken, {params.assembly.min_quality}, run);
                         }));
  return GuardStage(run, Stage::kAssemble, [&]() -> absl::StatusOr<CellComplex> {
    AMHEX_ASSIGN_OR_RETURN(const std::vector<int32_t> chosen, MergeCells(pieces, run));
    CellComplex complex = ComplexOfPieces(broken, pieces, chosen, hull.frame);
    ReportCells(complex, run);
    return complex;
  });
}

absl::StatusOr<CellComplex> Subdivide(const BrokenVolume& broken, const Hull& hull,
                                      RunContext& run) {
  AMHEX_RETURN_IF_ERROR(PassOver(Stage::kExtractTopology, run));
  return GuardStage(run, Stage::kAssemble, [&]() -> absl::StatusOr<CellComplex> {
    AMHEX_ASSIGN_OR_RETURN(CellComplex complex, SubdivideCells(broken, hull.frame, run));
    ReportCells(complex, run);
    return complex;
  });
}

}  // namespace

absl::StatusOr<MeshingResult> MeshVolume(const VolumeMesh& volume, const Guidance& guidance,
                                         const MeshingParams& params, RunContext& run) {
  BrokenVolume broken;
  AMHEX_ASSIGN_OR_RETURN(
      const Hull hull, GuardStage(run, Stage::kCheckInput, [&]() -> absl::StatusOr<Hull> {
        AMHEX_ASSIGN_OR_RETURN(broken, CheckAndBreak(volume, guidance, params, run));
        return BuildHullOfVolume(broken, params, run);
      }));
  for (const Stage stage :
       {Stage::kSampleHull, Stage::kPopulate, Stage::kRelax, Stage::kMatchAndMerge}) {
    AMHEX_RETURN_IF_ERROR(PassOver(stage, run));
  }
  const bool is_subdivided = params.input.volume_use == VolumeUse::kSubdivide;
  AMHEX_ASSIGN_OR_RETURN(const CellComplex assembled, is_subdivided
                                                          ? Subdivide(broken, hull, run)
                                                          : Reassemble(broken, hull, params, run));
  AMHEX_ASSIGN_OR_RETURN(const CellComplex closed,
                         GuardStage(run, Stage::kClose, [&]() -> absl::StatusOr<CellComplex> {
                           if (!HasOpenFaces(assembled)) return assembled;
                           return CloseComplex(assembled, hull, params, run);
                         }));
  AMHEX_RETURN_IF_ERROR(PassOver(Stage::kPlaceVertices, run));
  AMHEX_ASSIGN_OR_RETURN(MeshingResult result, GuardStage(run, Stage::kValidate, [&] {
                           return JudgeReassembled(FinalizeReassembled(closed, broken, hull.frame),
                                                   hull, OwnOverlap(broken), StopPoll(run));
                         }));
  result.stages = run.stage_reports();
  result.effective_params = params;
  result.effective_params.run.backend = Backend::kCpu;
  result.backend_note = "cpu; cells that are there already have nothing to relax";
  return result;
}

}  // namespace amhex
