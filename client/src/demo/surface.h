// Closed surface meshes of the generated shapes.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "demo/shapes.h"

namespace amhex::client {

// Dual contouring (Ju et al. 2002) on a grid of `resolution` cells along the shape's longest side:
// one vertex per grid cell that the surface passes through, placed where the surface's tangent
// planes meet, so that sharp edges and corners are kept. Outward oriented.
// The result is a closed manifold: INTERNAL if the grid is too coarse for that.
// INVALID_ARGUMENT if `resolution` is outside [8, 400]. Time and memory grow with its cube.
absl::StatusOr<TriangleMesh> ContourShape(const Shape& shape, int resolution);

inline constexpr int kDefaultContourResolution = 72;

}  // namespace amhex::client
