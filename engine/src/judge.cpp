#include "judge.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "output/mesh_statistics.h"
#include "output/missed_places.h"
#include "output/validate.h"

namespace amhex {
namespace {

// Where the boundary is another surface than the input, apart from its shape.
void WarnOfTopology(const Hull& hull, MeshingResult& result) {
  if (!hull.is_given || hull.genus < 0) return;
  const MeshStatistics& statistics = result.statistics;
  if (statistics.genus != hull.genus) {
    result.warnings.push_back(absl::StrCat("the mesh has ", statistics.genus,
                                           " handles or tunnels, the input ", hull.genus,
                                           ": smaller cells may keep to it"));
  }
  if (statistics.boundary_component_count != hull.component_count) {
    result.warnings.push_back(absl::StrCat("the mesh has ", statistics.boundary_component_count,
                                           " separate boundaries, the input ", hull.component_count,
                                           ": smaller cells may keep to it"));
  }
}

}  // namespace

absl::StatusOr<MeshingResult> Judge(AtMostHexaMesh mesh, const Hull& hull, const StopPoll& poll,
                                    DeviceUse* device) {
  absl::StatusOr<MeshingResult> result =
      JudgeReassembled(std::move(mesh), hull, OverlapReport(), poll, device);
  if (result.ok()) WarnOfTopology(hull, *result);
  return result;
}

absl::StatusOr<MeshingResult> JudgeReassembled(AtMostHexaMesh mesh, const Hull& hull,
                                               const OverlapReport& given, const StopPoll& poll,
                                               DeviceUse* device) {
  if (mesh.corners.empty()) {
    return absl::InvalidArgumentError(
        "the solid is too thin for a cell of the wanted edge length anywhere; ask for more cells");
  }
  MeshingResult result;
  result.mesh = std::move(mesh);
  const ValidationReport report = ValidateMesh(result.mesh, poll, device);
  const bool is_as_given = given.Any() && report.OnlyOverlaps();
  if (!report.valid() && !is_as_given) {
    return absl::InternalError(
        absl::StrCat("no valid mesh was found: ", report.Summary(), "; try another cell count"));
  }
  result.statistics = MeasureMesh(result.mesh, hull, poll, device);
  result.warnings = hull.warnings;
  if (result.statistics.distance_exceeds_cell) {
    std::string missed = DescribeMissedPlaces(FindMissedPlaces(result.mesh, hull, poll, device));
    if (!missed.empty()) result.warnings.push_back(std::move(missed));
  }
  if (is_as_given) {
    result.warnings.push_back(
        absl::StrCat("the volume mesh covers places twice, which was kept as given: at ",
                     report.overlap.overlapped_cells, " cells, ", report.overlap.overlapped_faces,
                     " faces and ", report.overlap.overlapped_edges, " edges of its boundary"));
  }
  return result;
}

}  // namespace amhex
