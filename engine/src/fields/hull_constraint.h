// What the hull demands of the background grid's nodes next to it; usable where bodies run.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "amhex/vec3.h"
#include "fields/grid_keys.h"
#include "input/hull_view.h"

namespace amhex::fields {

// "The hull passes through `point` with the outward unit `normal`."
struct HullConstraint {
  Vec3d normal;
  Vec3d point;
};

// Up to three that differ clearly: a face, a sharp edge, a corner.
struct HullConstraints {
  std::array<HullConstraint, 3> item;
  int count = 0;

  AMHEX_HD const HullConstraint* begin() const { return item.data(); }
  AMHEX_HD const HullConstraint* end() const { return item.data() + count; }
};

// A node is next to the hull when the hull is closer than this (in grid spacings).
inline constexpr double kHullReach = 1.0;

// What the hull demands there.
struct ConstraintsOf {
  CellCentres points;

  AMHEX_HD HullConstraints operator()(const HullView& hull, int64_t i) const {
    // Further normals are looked for from six offsets of this length; together with the slack on
    // the reach this sees the other faces of sharp edges and corners.
    constexpr double kOffset = 0.9;
    constexpr double kOffsetReach = 1.9;
    constexpr double kFurtherReach = 1.1;
    const Vec3d position = points[i];
    const double spacing = points.side;
    HullConstraints constraints;
    const HullPoint nearest = hull.Closest(position, kHullReach * spacing);
    if (nearest.triangle < 0) return constraints;
    AddIfDistinct(nearest, constraints);
    for (int direction = 0; direction < 6; ++direction) {
      Vec3d probe = position;
      probe[direction / 2] += ((direction & 1) != 0 ? -kOffset : kOffset) * spacing;
      const HullPoint hit = hull.Closest(probe, kOffsetReach * spacing);
      if (hit.triangle < 0 || Norm(hit.point - position) > kFurtherReach * spacing) continue;
      AddIfDistinct(hit, constraints);
    }
    return constraints;
  }

 private:
  AMHEX_HD static void AddIfDistinct(const HullPoint& hit, HullConstraints& constraints) {
    // A further normal counts when it differs from those known by more than about 37 degrees.
    constexpr double kDistinctCosine = 0.8;
    if (constraints.count == static_cast<int>(constraints.item.size())) return;
    for (const HullConstraint& known : constraints) {
      if (Dot(known.normal, hit.normal) > kDistinctCosine) return;
    }
    constraints.item[constraints.count++] = {hit.normal, hit.point};
  }
};

}  // namespace amhex::fields
