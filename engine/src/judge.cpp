#include "judge.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "output/mesh_statistics.h"
#include "output/validate.h"

namespace amhex {

absl::StatusOr<MeshingResult> Judge(AtMostHexaMesh mesh, const Hull& hull) {
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
