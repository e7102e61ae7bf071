// The matrix W + K C^T C of the lattice form on flat vectors of nine numbers per slot
// (node_slots.h); C = curl around the regular squares, W = weight of the correction, larger on
// edges that follow the hull.
#pragma once

#include <cstdint>
#include <vector>

#include "fields/hull_edges.h"
#include "fields/lattice_form.h"
#include "fields/linear_operators.h"
#include "fields/node_slots.h"

namespace amhex::fields {

class ClosureSystem {
 public:
  // Must outlive the system.
  struct Lattice {
    const GridLevel& level;
    const ForwardCodes& codes;
    const RunContext& run;
  };
  // `follows` by node, of FollowHull. What a stopped run leaves is not to be used.
  ClosureSystem(const Lattice& lattice, const LatticeSettings& settings,
                std::vector<uint16_t> follows);

  // Node by node.
  void Curls(const Increments& x, Increments* curls) const;
  Vec3f Adjoint(const Increments& curls, int64_t node, int d) const;
  // W plus K per square that the edge bounds.
  Vec3f DiagonalAt(int64_t node, int d) const;

  // product = W x + K C^T C x, eight slots at a time, from slot `begin` to `end`: first all curls
  // C x, then the rest.
  void ApplyCurl(int64_t begin, int64_t end, const float* x, float* curls) const;
  struct Vectors {
    const float* x;
    const float* curls;
    float* product;
  };
  void ApplyAdjoint(int64_t begin, int64_t end, const Vectors& vectors) const;

  // The same for a device, on this system's arrays.
  ClosureOperator Matrix(const NodeLinks& links) const;
  SlotLinks Links() const { return {slots_, level_, codes_, run_}; }

  const NodeSlots& slots() const { return slots_; }
  static int64_t Place(int64_t slot, int d, int axis) {
    return PlaceInCube(slot, ClosureOperator::kUnknowns, 3 * d + axis);
  }

 private:
  bool IsRegular(int64_t node, int d) const {
    const int64_t slot = slots_.SlotOf(node);
    return (is_regular_[3 * (slot / kCubeSlots) + d] >> (slot % kCubeSlots) & 1) != 0;
  }
  void SetSlot(int64_t slot);

  const GridLevel& level_;
  const ForwardCodes& codes_;
  const RunContext& run_;
  NodeSlots slots_;
  float weight_;
  float hull_weight_;
  std::vector<uint16_t> follows_;
  // As ClosureOperator's.
  std::vector<uint8_t> is_regular_;
  std::vector<uint8_t> follows_in_cube_;
};

}  // namespace amhex::fields
