// Whether edges of the hull are sharp to cells (sharp_features.h), as a question to the hull;
// usable where bodies run.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/arc_tangent.h"
#include "base/array_view.h"
#include "input/hull_view.h"

namespace amhex {

// One side of an edge.
struct SideOfEdge {
  Vec3d normal;       // of its triangle
  Vec3d away;         // unit, in the triangle's plane, away from the edge
  double height = 0;  // of the triangle above the edge
};
struct ProbedEdge {
  Vec3d middle;
  SideOfEdge left, right;
};
// Views do not own.
struct ProbedEdges {
  ArrayView<const ProbedEdge> edges;

  int64_t count() const { return edges.size; }
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(edges);
  }
};

// 1 where an edge is.
struct IsSharpToCells {
  using Answer = uint8_t;
  ProbedEdges points;
  double cosine = 0;  // of the angle that normals on both sides have to differ by

  AMHEX_HD uint8_t operator()(const HullView& hull, int64_t i) const {
    const ProbedEdge& edge = points.edges[i];
    return !IsFacet(hull, edge) && HasSides(hull, edge) ? 1 : 0;
  }

 private:
  // One of many, between the facets of a round.
  AMHEX_HD static bool IsFacet(const HullView& hull, const ProbedEdge& edge) {
    constexpr double kAlwaysSharp = 60 * std::numbers::pi / 180;
    // The share of the edge's angle by which the hull turns on.
    constexpr double kFacetAngleRatio = 0.5;
    const double angle = AngleBetween(edge.left.normal, edge.right.normal);
    return angle < kAlwaysSharp &&
           TurnBeyond(hull, edge.middle, edge.left) > kFacetAngleRatio * angle &&
           TurnBeyond(hull, edge.middle, edge.right) > kFacetAngleRatio * angle;
  }

  AMHEX_HD bool HasSides(const HullView& hull, const ProbedEdge& edge) const {
    // How far to either side the normals are compared, and how many of the comparisons must agree:
    // fillets and thin walls have room for the near ones only.
    constexpr double kProbeDistances[] = {0.15, 0.3, 0.45};
    constexpr int kAgreeingProbes = 2;
    int agreeing = 0;
    for (const double distance : kProbeDistances) {
      const Vec3d left = hull.Closest(edge.middle + edge.left.away * distance).normal;
      const Vec3d right = hull.Closest(edge.middle + edge.right.away * distance).normal;
      if (Dot(left, right) < cosine) ++agreeing;
    }
    return agreeing >= kAgreeingProbes;
  }

  AMHEX_HD static double AngleBetween(const Vec3d& a, const Vec3d& b) {
    return ArcTangent2(Norm(Cross(a, b)), Dot(a, b));
  }

  // By how much the hull turns beyond the edge's triangle on one side.
  AMHEX_HD static double TurnBeyond(const HullView& hull, const Vec3d& middle,
                                    const SideOfEdge& side) {
    // How far beyond the triangle the hull is looked at, in its heights but at least this many edge
    // lengths.
    constexpr double kBeyondTriangle = 1.5;
    constexpr double kLeastBeyond = 0.3;
    const double distance = Larger(kBeyondTriangle * side.height, kLeastBeyond);
    return AngleBetween(side.normal, hull.Closest(middle + side.away * distance).normal);
  }
};

}  // namespace amhex
