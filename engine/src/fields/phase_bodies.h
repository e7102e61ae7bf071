// What lies before and after the solves of a phase field, node by node; usable where bodies run.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/arc_tangent.h"
#include "base/array_view.h"
#include "base/sine_of_turns.h"
#include "fields/form_bodies.h"
#include "fields/grid_keys.h"
#include "fields/hull_nodes.h"
#include "fields/nearest_axis.h"

namespace amhex::fields {

// Of the plain solve: fixes what no hull fixes.
inline constexpr float kPlainPull = 1e-4F;

// What the hull wishes of the phases of some nodes; of the others it wishes nothing.
struct HullWishes {
  ArrayView<const int32_t> nodes;
  ArrayView<const float> weights;  // [place among those nodes][axis]
  ArrayView<const float> targets;  // likewise, real and imaginary part, times the weight
};

// "Centres half a cell below the hull"; one element per node that is next to it.
struct FindWishesBody {
  HullNodes at_hull;
  CellCentres places;  // of all nodes
  ArrayView<const Quaternion> frames;
  ArrayView<const Vec3d> sizes;
  double weight = 0;
  ArrayView<float> weights, targets;  // of HullWishes

  AMHEX_HD void operator()(int64_t k) const {
    for (int u = 0; u < 3; ++u) weights[3 * k + u] = 0;
    for (int u = 0; u < 6; ++u) targets[6 * k + u] = 0;
    const int32_t i = at_hull.nodes[k];
    const AxisFrame frame = ToFrame(frames[i]);
    for (int32_t at = at_hull.first[k]; at < at_hull.first[k + 1]; ++at) {
      const HullConstraint& c = at_hull.constraints[at];
      const NearestAxis nearest = FindNearestAxis(frame, c.normal);
      if (nearest.cosine <= kAlignedCosine) continue;
      const double size = sizes[i][nearest.axis];
      // Way along the axis from the node to the layer of centres below the hull.
      const double way = nearest.sign * (Dot(c.normal, c.point - places[i]) - size / 2);
      const CosineAndSine target = OfTurns(-way / size);
      const int64_t u = 3 * k + nearest.axis;
      weights[u] += static_cast<float>(weight);
      targets[2 * u] += static_cast<float>(weight * target.cosine);
      targets[2 * u + 1] += static_cast<float>(weight * target.sine);
    }
  }
};

// The lattice point that a node is nearest to, by its phases; one element per node.
struct FindPositionBody {
  CellCentres places;
  ArrayView<const CellSteps> steps;
  ArrayView<const float> x;  // [6 * node + 2 * axis] real and imaginary part
  ArrayView<Vec3d> positions;
  AMHEX_HD void operator()(int64_t i) const {
    constexpr double kFullTurn = 2 * std::numbers::pi;
    Vec3d p = places[i];
    for (int a = 0; a < 3; ++a) {
      const double phase = ArcTangent2(x[2 * (3 * i + a) + 1], x[2 * (3 * i + a)]) / kFullTurn;
      p -= steps[i][a] * phase;
    }
    positions[i] = p;
  }
};

// Onto the layer of cell centres that is nearest along each aligned hull normal; one element per
// node that is next to the hull.
struct ProjectToLayersBody {
  HullNodes at_hull;
  ArrayView<const Quaternion> frames;
  ArrayView<const Vec3d> sizes;
  ArrayView<Vec3d> positions;

  AMHEX_HD void operator()(int64_t k) const {
    // Over a node's hull constraints when it has several: they are not quite orthogonal.
    constexpr int kSeveralRounds = 3;
    const int32_t i = at_hull.nodes[k], begin = at_hull.first[k], end = at_hull.first[k + 1];
    const AxisFrame frame = ToFrame(frames[i]);
    Vec3d position = positions[i];
    const int rounds = end - begin > 1 ? kSeveralRounds : 1;
    for (int round = 0; round < rounds; ++round) {
      for (int32_t at = begin; at < end; ++at) {
        const HullConstraint& c = at_hull.constraints[at];
        const NearestAxis nearest = FindNearestAxis(frame, c.normal);
        if (nearest.cosine <= kAlignedCosine) continue;
        const double height = sizes[i][nearest.axis];
        const double off = Dot(c.normal, position - c.point) + height / 2;
        position -= c.normal * (off - height * std::round(off / height));
      }
    }
    positions[i] = position;
  }
};

}  // namespace amhex::fields
