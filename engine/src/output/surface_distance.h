// How far two surfaces are from each other, by samples.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "input/ask_hull.h"

namespace amhex {

struct DistanceSummary {
  double maximum = 0;
  double mean = 0;
};

// Points on the hull's triangles, one per `spacing` squared of area, evenly spread. At most
// ~10^6: larger surfaces are sampled more sparsely.
std::vector<Vec3d> SampleSurface(const std::vector<Vec3d>& vertices,
                                 const std::vector<std::array<int32_t, 3>>& triangles,
                                 double spacing);

// Distances of `points` to the surface; zeros without points. Independent of the thread count.
// Throws what the asker does.
DistanceSummary DistanceToSurface(const std::vector<Vec3d>& points, const HullAsker& surface);

// The largest of them, sooner; where that is `enough` or less, something not above it.
double FarthestFromSurface(const std::vector<Vec3d>& points, double enough,
                           const HullAsker& surface);

}  // namespace amhex
