// Clouds that came without normals: which side of a part is solid.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "input/cloud_samples.h"

namespace amhex {

// Turns the normals of every closed part that lies in an odd number of other closed parts: every
// second nesting level is hollow, as where a surface's triangles say nothing (OrientComponents).
// A part is what neighbours beside each other connect, its normals are taken to look outward; those
// that bound no solid of their own or lie only partly in others stay as they are. Returns how many
// were turned. O(n log n) for few parts, besides quadratic in their number.
absl::StatusOr<int64_t> HollowNestedParts(RunContext& run, CloudSamples& samples);

// Turns the normals of samples that look into what they bound: winding numbers below zero above
// them tell. One orientation carried on from neighbour to neighbour is wrong behind every place
// where two bodies touch. Returns how many were turned. O(n log n).
absl::StatusOr<int64_t> TurnInsideOutSamples(RunContext& run, CloudSamples& samples);

}  // namespace amhex
