// Where each vertex may be: anywhere inside, on its patch of the hull, on a crease, at a corner, or
// nowhere but where it is.
#pragma once

#include <cstdint>
#include <vector>

#include "assembly/cell_complex.h"
#include "optimize/constrain.h"
#include "optimize/hull_features.h"
#include "optimize/vertex_neighbourhoods.h"

namespace amhex {

struct VertexConstraints {
  std::vector<VertexConstraint> vertex;  // [vertex_count]
  std::vector<int32_t> face_patch;       // [hull face] the patch it lies on
  std::vector<Vec3d> face_normal;        // [hull face] of its patch, near its centre, unit
};

// Assigns every hull vertex. A vertex gets a crease or a corner only where its own hull faces lie
// on the patches that meet there; every corner gets the nearest such vertex. O(n log n).
// Throws RunStopped when `poll` does.
VertexConstraints AssignConstraints(const CellComplex& complex,
                                    const VertexNeighbourhoods& neighbourhoods,
                                    const HullFeatures& features, const StopPoll& poll = {});

// The next weaker constraint of a vertex that cannot reach its target: corner to crease or patch,
// crease to the patch nearest to `p`. Patches stay.
VertexConstraint Weakened(const VertexConstraint& constraint, const Vec3d& p,
                          const HullFeatures& features);

}  // namespace amhex
