// Solids with hulls and samples for the tests of the relaxation.
#pragma once

#include <cstddef>

#include "amhex/input_hull.h"
#include "input/hull.h"
#include "support/hull_of_mesh.h"

namespace amhex {

// One sample per triangle, without curvature.
inline HullSamples SamplesOf(const Hull& hull) {
  HullSamples samples;
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    Vec3d centre;
    for (const int32_t v : hull.triangles[t]) centre += hull.vertices[static_cast<size_t>(v)];
    samples.position.push_back(centre / 3.0);
    samples.normal.push_back(hull.triangle_normals[t]);
    samples.tangent.push_back({});
    samples.curvature_confidence.push_back(0.0f);
  }
  return samples;
}

}  // namespace amhex
