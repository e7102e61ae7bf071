// The run of a volume mesh whose cells are reassembled: no sites, no relaxation.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/mesher.h"

namespace amhex {

// Every stage is reported; those that a reassembly does not need take no time. `params` have been
// validated. Errors as for Mesh, and INVALID_ARGUMENT for a wanted size or guidance: the cells are
// there already, and none of their vertices moves.
absl::StatusOr<MeshingResult> MeshVolume(const VolumeMesh& volume, const Guidance& guidance,
                                         const MeshingParams& params, RunContext& run);

}  // namespace amhex
