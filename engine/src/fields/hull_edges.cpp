#include "fields/hull_edges.h"

#include <optional>

namespace amhex::fields {
namespace {

// Two ends belong to the same smooth piece if their normals differ by less than about 37 degrees.
constexpr double kSamePieceCosine = 0.8;

// The layers under one piece of hull, at one node.
struct Layers {
  int axis = 0;
  double sign = 1;   // the axis' side that looks outward
  double depth = 0;  // of the node below the hull, edge lengths
  double size = 1;   // of a layer, edge lengths
};

// Nothing where the frame stands askew to the hull.
std::optional<Layers> LayersAt(const ExpectedLattice& lattice, int64_t node,
                               const HullConstraint& hull) {
  const NearestAxis nearest = FindNearestAxis(ToFrame(lattice.frames[node]), hull.normal);
  if (nearest.cosine <= kAlignedCosine) return std::nullopt;
  return Layers{nearest.axis, nearest.sign,
                Dot(hull.normal, hull.point - lattice.grid.Position(node)),
                lattice.sizes[node][nearest.axis]};
}

// What the hull demands of the two ends of an edge.
struct PiecePair {
  const HullConstraint& from;
  const HullConstraint& to;
};

// Edge d of node i against one constraint of each end. Returns the bit of the number written.
uint16_t FollowPiece(const ExpectedLattice& lattice, int64_t i, int d, const PiecePair& piece,
                     Increments* increments) {
  const auto& [from, to] = piece;
  if (Dot(from.normal, to.normal) < kSamePieceCosine) return 0;
  const std::optional<Layers> here = LayersAt(lattice, i, from);
  const std::optional<Layers> there = LayersAt(lattice, lattice.grid.fine().neighbours[i][d], to);
  if (!here.has_value() || !there.has_value()) return 0;
  const AxisRotation& rotation = kAxisRotations[lattice.codes[i][d]];
  const int axis = here->axis;
  if (rotation.source[axis] != there->axis) return 0;
  if (rotation.sign[axis] * there->sign != here->sign) return 0;
  const double rise = here->sign * (here->depth - there->depth);
  (*increments)[i][d][axis] = static_cast<float>(2 * rise / (here->size + there->size));
  return static_cast<uint16_t>(1U << (3 * d + axis));
}

}  // namespace

std::vector<uint16_t> FollowHull(const ExpectedLattice& lattice, const RunContext& run,
                                 Increments* increments) {
  const GridLevel& level = lattice.grid.fine();
  std::vector<uint16_t> follows(level.count(), 0);
  ForEach(run, level.at_hull.View().count(), [&](int64_t k) {
    const int32_t i = level.at_hull.nodes[k];
    for (int d = 0; d < 3; ++d) {
      const int32_t j = level.neighbours[i][d];
      if (j < 0) continue;
      for (const HullConstraint& from : level.ConstraintsOf(i)) {
        for (const HullConstraint& to : level.ConstraintsOf(j)) {
          follows[i] = static_cast<uint16_t>(follows[i] |
                                             FollowPiece(lattice, i, d, {from, to}, increments));
        }
      }
    }
  });
  return follows;
}

}  // namespace amhex::fields
