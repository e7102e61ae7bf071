// How thick a solid is below places on its hull, as a question to the hull; usable where bodies
// run.
#pragma once

#include <cstdint>

#include "base/array_view.h"
#include "input/hull_view.h"

namespace amhex {

// A ray into the solid.
struct InwardRay {
  Vec3d origin;
  Vec3d inward;           // unit
  double min_length = 0;  // below it the ray has met where it starts
};
// Views do not own.
struct InwardRays {
  ArrayView<const InwardRay> rays;

  int64_t count() const { return rays.size; }
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(rays);
  }
};

// The length to where the ray leaves; a negative number if it does not.
struct WidthAt {
  using Answer = double;
  InwardRays points;
  AMHEX_HD double operator()(const HullView& hull, int64_t i) const {
    const InwardRay& ray = points.rays[i];
    return hull.ExitDistance(ray.origin, ray.inward, ray.min_length);
  }
};

}  // namespace amhex
