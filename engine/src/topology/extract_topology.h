// From merged cubes to all primitives the mesh may be assembled from. Section 5.2, I and II.
//
// Two ways in, one mechanism (params.assembly.extraction):
//   kDirect  cubes that already are hexahedra of high quality start the mesh; all other cubes that
//            are cells, and what a search around them finds, compete for the rest. Deviates: the
//            same competition with far less to search.
//   kPaper   faces and primitives of the whole edge network; the found hexahedra of high quality
//            start the mesh.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "geometry/merged_cubes.h"
#include "topology/primitive_table.h"

namespace amhex {

// Primitives in the table are valid (CellQuality > 0) with a quality above
// params.assembly.min_quality.
// Errors: INVALID_ARGUMENT if the arrays of `cubes` disagree in length or name a vertex that does
// not exist, CANCELLED, DEADLINE_EXCEEDED, those of DeviceUse. Linear time and memory in the number
// of cubes.
absl::StatusOr<PrimitiveTable> ExtractTopology(const MergedCubes& cubes,
                                               const MeshingParams& params, RunContext& context);

}  // namespace amhex
