// Layers that follow the hull: along it, the lattice advances across the layers by exactly as much
// as the two ends differ in depth.
#pragma once

#include <cstdint>
#include <vector>

#include "fields/background_grid.h"
#include "fields/lattice_form.h"
#include "fields/orientation_field.h"

namespace amhex::fields {

// The fields that a lattice form is made from; must outlive this.
struct ExpectedLattice {
  const BackgroundGrid& grid;
  const std::vector<Quaternion>& frames;
  const std::vector<Vec3d>& sizes;
  const ForwardCodes& codes;
};

// Where both ends of an edge d lie next to the same smooth piece of hull, overwrites the increment
// of the axis a along its normal by the difference of the depths, in cells. Returns, per node, bit
// 3 d + a for each number written. O(nodes).
std::vector<uint16_t> FollowHull(const ExpectedLattice& lattice, const RunContext& run,
                                 Increments* increments);

inline bool Follows(const std::vector<uint16_t>& follows, int64_t node, int d, int axis) {
  return (follows[node] >> (3 * d + axis) & 1) != 0;
}

}  // namespace amhex::fields
