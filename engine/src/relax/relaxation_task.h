// One relaxation as plain host arrays: what crosses the border to the executors, and to the CUDA
// library that is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "amhex/vec3.h"
#include "base/quat.h"
#include "relax/hull_barrier.h"

namespace amhex {

// Everything in the domain frame (hull_barrier.h), edge lengths.
struct RelaxationTask {
  HullBarrier barrier;
  std::vector<LabelItem> items;

  // Sites; grow when clusters are split, never shrink.
  std::vector<Vec3d> position;       // [site_count] in and out
  std::vector<Quatf> orientation;    // [site_count] in and out
  std::vector<Vec3f> size;           // [site_count]
  std::vector<int32_t> is_inside;    // [site_count] 0 or 1
  std::vector<int64_t> point_count;  // [site_count] out: lattice points of each cell

  // Hull samples, thinned (section 4.3).
  std::vector<Vec3f> sample_position;     // [sample_count]
  std::vector<Vec3f> sample_normal;       // [sample_count] unit
  std::vector<Quatf> sample_orientation;  // [sample_count] unit

  int32_t iteration_count = 0;
  double regularity_weight = 1.0;  // peak of w
  int32_t split_limit = 10;
  bool propagates_orientation = false;  // from the samples, before the first iteration

  // Both may be empty. The second gets iteration (1 based), mean movement and site count.
  std::function<bool()> should_stop;
  std::function<void(int32_t, double, int64_t)> on_iteration;

  int64_t split_count = 0;  // out
};

enum class RelaxationOutcome { kDone, kStopped };

}  // namespace amhex
