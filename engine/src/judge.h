// The last word on every mesh.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/mesher.h"
#include "input/hull.h"

namespace amhex {

// Mesh, statistics and warnings of a result; INTERNAL, naming the place, if the mesh breaks the
// law, which is checked by code that knows nothing of how the mesh was made; INVALID_ARGUMENT if
// the solid held no cell at all.
absl::StatusOr<MeshingResult> Judge(AtMostHexaMesh mesh, const Hull& hull);

}  // namespace amhex
