// Where each vertex may be, and the nearest such point; usable where bodies run.
#pragma once

#include <cstdint>

#include "optimize/feature_view.h"

namespace amhex {

enum class Constraint : uint8_t { kFree, kPatch, kCrease, kCorner, kFixed };

struct VertexConstraint {
  Constraint kind = Constraint::kFree;
  int32_t patch_a = -1;  // kPatch; kCrease: between patch_a and patch_b
  int32_t patch_b = -1;
  int32_t corner = -1;  // kCorner: index into HullFeatures::corners()
};

// A vertex this near to its crease or corner is on it, edge lengths.
inline constexpr double kOnFeature = 0.02;

// A point of a vertex's constraint set and the directions in which the vertex may move there.
struct ConstrainedPoint {
  Vec3d point;
  Vec3d normal;     // kPatch: of the hull; kCrease: unused
  Vec3d direction;  // kCrease: along it
};

// The admissible point nearest to `p`, which is not farther than `bound`; `p` itself for free
// and fixed vertices.
AMHEX_HD inline ConstrainedPoint ConstrainWithin(const VertexConstraint& constraint, const Vec3d& p,
                                                 double bound, const FeatureView& features) {
  constexpr double kAnywhere = 1e100;
  switch (constraint.kind) {
    case Constraint::kFree:
    case Constraint::kFixed:
      break;
    case Constraint::kPatch: {
      const HullPoint hit = features.patches[constraint.patch_a].Closest(p, bound);
      return {hit.point, hit.normal, {}};
    }
    case Constraint::kCrease: {
      const CreaseView* crease = features.CreaseBetween(constraint.patch_a, constraint.patch_b);
      if (crease == nullptr) break;
      const SegmentPoint hit = crease->segments.Closest(p, kAnywhere);
      if (hit.segment < 0) break;
      const LineSegment& segment = crease->segments.segments[hit.segment];
      return {hit.point, {}, Normalized(segment.second - segment.first)};
    }
    case Constraint::kCorner:
      return {features.corners[constraint.corner], {}, {}};
  }
  return {p, {}, {}};
}

AMHEX_HD inline ConstrainedPoint Constrain(const VertexConstraint& constraint, const Vec3d& p,
                                           const FeatureView& features) {
  return ConstrainWithin(constraint, p, 1e300, features);
}

// The same, faster: `known` is any admissible point.
AMHEX_HD inline ConstrainedPoint ConstrainFrom(const VertexConstraint& constraint, const Vec3d& p,
                                               const Vec3d& known, const FeatureView& features) {
  // The slack is for the rounding of distances: a bound too small by a bit would find nothing.
  constexpr double kRelativeSlack = 1e-9, kAbsoluteSlack = 1e-9;
  const double bound = Norm(p - known) * (1 + kRelativeSlack) + kAbsoluteSlack;
  return ConstrainWithin(constraint, p, bound, features);
}

}  // namespace amhex
