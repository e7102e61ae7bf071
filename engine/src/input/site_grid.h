// Site Population of section 4.1: S_v on a regular or jittered grid.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "input/hull.h"
#include "relax/sites.h"

namespace amhex {

// Sites at the centres of unit cubes stacked over the hull's box and a margin, centred on it, with
// the world's axes as frames and unit sizes; displaced by up to `relaxation.jitter` per axis for
// kJitteredGrid. Outside sites more than one hop (eq. 2) from the samples, or more than 1.25 edge
// lengths from the hull, are left out, as the paper's Outlook suggests. Ordered by z, y, x.
//
// Errors: INVALID_ARGUMENT (no site falls inside), RESOURCE_EXHAUSTED (the box holds absurdly more
// cubes than the hull), CANCELLED, DEADLINE_EXCEEDED. O(box volume), parallel.
absl::StatusOr<Sites> PopulateGrid(const Hull& hull, const HullSamples& samples,
                                   const MeshingParams& params, RunContext& run);

}  // namespace amhex
