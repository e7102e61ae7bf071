// Raises poor cells by moving all vertices around them at once, where each one alone is stuck.
#pragma once

#include "amhex/run_context.h"
#include "optimize/placement.h"

namespace amhex {

// What is wanted of the whole mesh: above what is refilled (refill_places) and what moves for the
// sake of the average and of distances may leave (place_vertices, follow_hull).
inline constexpr double kJointlyWanted = 0.33;

// Where cells below `wanted` share vertices, those and the vertices of all cells at them are moved
// together so that what the corners around lack to `wanted`, squared and added up, falls: least
// squares by Levenberg and Marquardt, place by place, the worst first. Vertices of patches and
// creases slide, corners and fixed ones stay. No cell comes to fold, no least scaled Jacobian of
// what is around a place falls, and hull faces turn and sag no more than moves of single vertices
// may make them (move_judge). The survey, which must be up to date, stays so. Some milliseconds of
// one thread per place; ends early when the run is to stop.
void RaiseJointly(Placement& placement, double wanted, const RunContext& run);

}  // namespace amhex
