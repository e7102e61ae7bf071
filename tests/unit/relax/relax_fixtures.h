// Solids with hulls and samples for the tests of the relaxation.
#pragma once

#include <cstddef>
#include <cstdint>

#include "amhex/input_hull.h"
#include "fixtures/solids.h"
#include "input/hull.h"
#include "relax/build_barrier.h"
#include "relax/relaxation_task.h"
#include "support/hull_of_mesh.h"
#include "unit/graph/random_points.h"

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

// So many random places in the box of a sphere; those inside the sphere are sites.
inline RelaxationTask RandomTask(int site_count, int32_t iteration_count, double radius = 5) {
  RunContext run;
  RelaxationTask task;
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeSphere(radius, 0.5));
  task.barrier = *BuildHullBarrier(hull, 32, 1.0, run);
  const BarrierView barrier = task.barrier.View();
  for (const Vec3f& unit : RandomPoints(3, site_count, 1)) {
    const Vec3d e = task.barrier.extent;
    const Vec3d p = {unit.x * e.x, unit.y * e.y, unit.z * e.z};
    if (!barrier.IsInside(p)) continue;
    task.position.push_back(p);
    task.orientation.push_back({});
    task.size.push_back({1, 1, 1});
    task.is_inside.push_back(1);
  }
  const HullSamples samples = SamplesOf(hull);
  for (size_t i = 0; i < samples.position.size(); ++i) {
    task.sample_position.push_back(ToFloat(samples.position[i] - task.barrier.origin));
    task.sample_normal.push_back(ToFloat(samples.normal[i]));
    task.sample_orientation.push_back({});
  }
  task.items = ListLabelItems(task.barrier, {});
  task.iteration_count = iteration_count;
  task.propagates_orientation = iteration_count > 0;
  return task;
}

}  // namespace amhex
