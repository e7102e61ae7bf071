// Why no mesh was found, where the input's thickness tells.
#pragma once

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "input/hull.h"

namespace amhex {

// `error` of a run over `hull`. Where most of the solid's surface is less than half an edge length
// from its other side, and `error` says that no sites or no cells were found: INVALID_ARGUMENT that
// tells how thin the solid is, where, and which edge length fits. Else `error`.
absl::Status TellThinWalls(absl::Status error, const Hull& hull, const RunContext& run);

}  // namespace amhex
