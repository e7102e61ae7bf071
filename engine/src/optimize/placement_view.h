// What the moves of one vertex read and write, as plain arrays: the same on the host and where
// bodies run.
#pragma once

#include <cstdint>

#include "base/array_view.h"
#include "optimize/cell_pattern.h"
#include "optimize/constrain.h"
#include "optimize/feature_view.h"
#include "topology/primitives.h"

namespace amhex {

// Rows of Incidence (vertex_neighbourhoods.h).
struct IncidenceView {
  ArrayView<const int64_t> first;  // [row_count + 1]
  ArrayView<const int32_t> item;

  AMHEX_HD ArrayView<const int32_t> operator[](int64_t row) const {
    return {item.data + first[row], first[row + 1] - first[row]};
  }
};

struct PlacementView {
  // Of the complex; vertices are moved in place.
  ArrayView<Vec3d> vertices;
  ArrayView<const CellCorners> cells;
  ArrayView<const CellFace> hull_faces;
  // Of the neighbourhoods.
  ArrayView<const CellPattern> patterns;     // of all cells of Figure 2
  ArrayView<const int16_t> pattern_of_cell;  // index into them
  IncidenceView cells_at;
  IncidenceView hull_faces_at;
  // Of the constraints.
  ArrayView<const VertexConstraint> constraints;  // [vertex]
  ArrayView<const Vec3d> face_normal;             // [hull face]
  // Of each vertex that belongs to a patch a point of it, near or infinitely far; empty where
  // bodies run on a device.
  ArrayView<Vec3d> known_feet;  // [vertex]
  // Of each hull face a triangle that its middle was near to, as HullView tells them apart, or -1;
  // empty on a device, and where vertices that share a face are moved side by side.
  ArrayView<int32_t> likely_triangles;  // [hull face]
  // Of the survey.
  ArrayView<float> min_scaled_jacobian;  // [cell]
  ArrayView<uint8_t> near_folding;       // [cell]
  FeatureView features;

  AMHEX_HD const CellPattern& PatternOf(int64_t cell) const {
    return patterns[pattern_of_cell[cell]];
  }
  // What stays as it is for as long as there are the same cells, but for the features.
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(cells), visit(hull_faces), visit(patterns), visit(pattern_of_cell);
    visit(cells_at.first), visit(cells_at.item);
    visit(hull_faces_at.first), visit(hull_faces_at.item);
    visit(face_normal);
  }
};

// Where its constraint admits the vertex, nearest to where it is.
AMHEX_HD inline ConstrainedPoint FootOf(const PlacementView& placement, int64_t v) {
  const VertexConstraint& constraint = placement.constraints[v];
  const Vec3d& p = placement.vertices[v];
  if (constraint.kind != Constraint::kPatch || placement.known_feet.empty()) {
    return Constrain(constraint, p, placement.features);
  }
  return ConstrainFrom(constraint, p, placement.known_feet[v], placement.features);
}

// The same, and keeps it for the next time.
AMHEX_HD inline ConstrainedPoint FindFoot(const PlacementView& placement, int64_t v) {
  const ConstrainedPoint foot = FootOf(placement, v);
  if (placement.constraints[v].kind == Constraint::kPatch && !placement.known_feet.empty()) {
    placement.known_feet[v] = foot.point;
  }
  return foot;
}

// Whether the middle of a hull face, at `middle`, is within this distance of the hull.
AMHEX_HD inline bool MiddleIsWithin(const PlacementView& placement,
                                    [[maybe_unused]] int32_t hull_face, const Vec3d& middle,
                                    double distance) {
#if !defined(__CUDACC__)
  if (!placement.likely_triangles.empty()) {
    return placement.features.hull.IsWithin(middle, distance,
                                            placement.likely_triangles[hull_face]);
  }
#endif
  return placement.features.hull.IsWithin(middle, distance);
}

}  // namespace amhex
