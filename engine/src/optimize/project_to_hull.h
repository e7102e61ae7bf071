// Draws hull vertices to the hull, to its creases and to its corners.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "optimize/placement.h"

namespace amhex {

// One pass: every hull vertex `among` these moves towards its constraint's nearest point, as far as
// the rules of MoveJudge allow. No neighbourhood falls below all of: its old minimum,
// `quality_floor`, and the larger of 0.25 and three quarters of its old minimum. Returns the number
// of vertices moved and activates their neighbourhoods in `memory`.
absl::StatusOr<int64_t> ProjectToHull(Placement& placement, const ActiveVertices& among,
                                      double quality_floor, SweepMemory& memory,
                                      const RunContext& run);

// Vertices farther than `tolerance` edge lengths from their crease or corner get the next weaker
// constraint. Patches stay. This and the next throw RunStopped when `poll` does.
void WeakenUnreached(Placement& placement, double tolerance, const StopPoll& poll = {});

// Largest distance of a hull vertex `among` these from its constraint, edge lengths.
double LargestOffset(Placement& placement, const ActiveVertices& among, const StopPoll& poll = {});

}  // namespace amhex
