// The sample set S_pc on the hull, each with its surface frame. Paper: 4.1 and 4.3.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "input/hull.h"

namespace amhex {

// Samples about half an edge length apart (no two of one patch and side nearer than 0.45), some
// three per unit of area, with normals and principal directions.
//
// Curvature is the mean over the surroundings of one edge length, the scale of the cells, and never
// looks across a sharp edge. Within 0.75 of a sharp edge the tangent runs along the edge, with
// confidence 1. Elsewhere the confidence is
//   |k1 - k2| / (|k1| + |k2|)  *  s / (s + 0.05),   s = |k1| + |k2| (per edge length):
// how much the two curvatures differ, faded out where the surface is flat within a cell.
//
// Same hull, same samples, wherever they are computed. CANCELLED or DEADLINE_EXCEEDED if the run is
// stopped, RESOURCE_EXHAUSTED if there are more than 2^31 candidates, and the errors of a device.
absl::StatusOr<HullSamples> SampleHull(const Hull& hull, Backend backend, RunContext& run);

}  // namespace amhex
