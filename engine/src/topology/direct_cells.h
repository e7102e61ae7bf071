// Cubes that already are cells once their vertices have been merged; 98 to 99.9 % of all.
//
// Not in the paper, which finds them again by graph search: looking at the merged corners costs
// nothing and gives the same primitives.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "geometry/merged_cubes.h"
#include "topology/primitive_table.h"

namespace amhex {

// The primitives of all cubes that are cells of Figure 2 with quality above
// params.assembly.min_quality, in the cubes' order; half_faces not filled in yet.
absl::StatusOr<std::vector<Primitive>> FindDirectCells(const MergedCubes& cubes,
                                                       const MeshingParams& params,
                                                       const RunContext& context);

// Fills in primitive.half_faces; every face must be in the table.
void LookUpHalfFaces(const FaceTable& faces, Primitive* primitive);

// [half_face_count] 1 where the table has a cube's hull face, or half of a quad one that was split.
std::vector<uint8_t> MarkHullFaces(const MergedCubes& cubes, const FaceTable& faces);

}  // namespace amhex
