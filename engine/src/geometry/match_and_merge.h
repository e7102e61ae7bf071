// Stage one of the extraction: cubes, matches, merge sets, cuts, hull faces. Paper: section 5.1.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "geometry/cubes.h"
#include "geometry/merged_cubes.h"
#include "input/hull.h"
#include "relax/sites.h"

namespace amhex {

class DeviceUse;
class HullQueries;

// Merges cubes: vertices, corners and matches. Unless `hull` is null also tells which faces and
// vertices are on it, and projects those vertices to it. On `device`, unless it is null, with the
// same bits. Errors: the run's status, and those of RunOnCuda.
absl::StatusOr<MergedCubes> MergeCubes(const Cubes& cubes, const std::vector<FaceLink>& links,
                                       RunContext& run, DeviceUse* device = nullptr,
                                       const HullQueries* hull = nullptr);

// Merges the cubes of all sites into one complex of real vertices. Never collapses a diagonal of
// a face or of a cube. O(n log n).
// Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<MergedCubes> MatchAndMerge(const Sites& sites, const Hull& hull,
                                          const MeshingParams& params, RunContext& run);

}  // namespace amhex
