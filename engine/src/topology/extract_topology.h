// From merged cubes to all primitives the mesh may be assembled from. Section 5.2, I and II.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "geometry/merged_cubes.h"
#include "topology/primitive_table.h"

namespace amhex {

// Errors: INVALID_ARGUMENT if the arrays of `cubes` disagree in length or name a vertex that does
// not exist, CANCELLED, DEADLINE_EXCEEDED. Linear time and memory in the number of cubes.
absl::StatusOr<PrimitiveTable> ExtractTopology(const MergedCubes& cubes,
                                               const MeshingParams& params, RunContext& context);

}  // namespace amhex
