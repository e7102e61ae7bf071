#include "judge.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "output/mesh_statistics.h"
#include "output/validate.h"

namespace amhex {

absl::StatusOr<MeshingResult> Judge(AtMostHexaMesh mesh, const Hull& hull) {
  if (mesh.corners.empty()) {
    return absl::InvalidArgumentError(
        "the solid is too thin for a cell of the wanted edge length anywhere; ask for more cells");
  }
  MeshingResult result;
  result.mesh = std::move(mesh);
  const ValidationReport report = ValidateMesh(result.mesh);
  if (!report.valid()) {
    return absl::InternalError(
        absl::StrCat("no valid mesh was found: ", report.Summary(), "; try another cell count"));
  }
  result.statistics = MeasureMesh(result.mesh, hull);
  result.warnings = hull.warnings;
  return result;
}

}  // namespace amhex
