// The first stage: from what the user sent to the surface that bounds the mesh.
// Paper: 4.1 "Input Hull", 6.1; Appendix B for clouds.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "input/hull.h"

namespace amhex {

// Checks, cleans and closes the input, resolves the edge length (see edge_length.h) and returns the
// hull in the normalised frame: edge length 1, origin at the centre of the input's box. All
// arithmetic before that runs relative to the box centre, so that scans far from their origin lose
// nothing.
//
// Errors: INVALID_ARGUMENT (parameters; non-finite coordinates, indices out of range, points in one
// plane, no enclosed volume: with the first offending index and the count), OUT_OF_RANGE (more
// cells or elements than the engine handles), RESOURCE_EXHAUSTED (memory limit), CANCELLED,
// DEADLINE_EXCEEDED. O(n log n) in the input's size.
//
// Of a volume mesh the boundary is taken.
absl::StatusOr<Hull> BuildHull(const InputHull& input, const MeshingParams& params,
                               RunContext& run);

// The hull of cells that are there already: `boundary` as it is, for the given edge length in the
// user's units. INVALID_ARGUMENT if it does not bound a solid by itself.
absl::StatusOr<Hull> BuildHullOfCells(const TriangleMesh& boundary, double edge_length,
                                      const MeshingParams& params, RunContext& run);

}  // namespace amhex
