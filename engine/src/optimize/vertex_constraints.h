// Where each vertex may be: anywhere inside, on its patch of the hull, on a crease, at a corner, or
// nowhere but where it is.
#pragma once

#include <cstdint>
#include <vector>

#include "assembly/cell_complex.h"
#include "optimize/hull_features.h"
#include "optimize/vertex_neighbourhoods.h"

namespace amhex {

enum class Constraint : uint8_t { kFree, kPatch, kCrease, kCorner, kFixed };

struct VertexConstraint {
  Constraint kind = Constraint::kFree;
  int32_t patch_a = -1;  // kPatch; kCrease: between patch_a and patch_b
  int32_t patch_b = -1;
  int32_t corner = -1;  // kCorner: index into HullFeatures::corners()
};

// A point of a vertex's constraint set and the directions in which the vertex may move there.
struct ConstrainedPoint {
  Vec3d point;
  Vec3d normal;     // kPatch: of the hull; kCrease: unused
  Vec3d direction;  // kCrease: along it
};

struct VertexConstraints {
  std::vector<VertexConstraint> vertex;  // [vertex_count]
  std::vector<int32_t> face_patch;       // [hull face] the patch it lies on
  std::vector<Vec3d> face_normal;        // [hull face] of its patch, near its centre, unit
};

// Assigns every hull vertex. A vertex gets a crease or a corner only where its own hull faces lie
// on the patches that meet there; every corner gets the nearest such vertex. O(n log n).
VertexConstraints AssignConstraints(const CellComplex& complex,
                                    const VertexNeighbourhoods& neighbourhoods,
                                    const HullFeatures& features);

// The admissible point nearest to `p`; `p` itself for free vertices.
ConstrainedPoint Constrain(const VertexConstraint& constraint, const Vec3d& p,
                           const HullFeatures& features);
// The same, faster: `known` is any admissible point.
ConstrainedPoint ConstrainFrom(const VertexConstraint& constraint, const Vec3d& p,
                               const Vec3d& known, const HullFeatures& features);

// The next weaker constraint of a vertex that cannot reach its target: corner to crease or patch,
// crease to the patch nearest to `p`. Patches stay.
VertexConstraint Weakened(const VertexConstraint& constraint, const Vec3d& p,
                          const HullFeatures& features);

}  // namespace amhex
