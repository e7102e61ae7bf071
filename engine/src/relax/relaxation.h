// The relaxation of section 4: from populated sites to sites whose cells are as cubical, as equal
// and as well aligned as the hull permits.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "input/hull.h"
#include "relax/sites.h"

namespace amhex {

// Lloyd iterations that `params` asks for once -1 is resolved: 0 after the field start, 150 after
// the grids (section 6.2).
int32_t ResolveIterationCount(const RelaxationParams& params);

// Relaxes `sites` (normalised frame; inside and outside sites mixed) and returns the inside ones
// in their order, new ones from splits last, each with the volume of its Chebyshev cell. With zero
// iterations positions and frames stay to the bit and only the volumes are measured.
//
// Laws: no inside site is ever lost, none crosses the hull; the same input gives the same bits at
// any thread count. Links survive (renumbered) unless a site was split.
//
// Errors: INVALID_ARGUMENT (no site inside), FAILED_PRECONDITION (CUDA asked for and not usable,
// with the reason), RESOURCE_EXHAUSTED, CANCELLED, DEADLINE_EXCEEDED.
// O(sites * iterations * lattice points per site), parallel; about 0.5 kB per site.
absl::StatusOr<Sites> RelaxSites(const Hull& hull, const HullSamples& samples, const Sites& sites,
                                 const MeshingParams& params, RunContext& run);

}  // namespace amhex
