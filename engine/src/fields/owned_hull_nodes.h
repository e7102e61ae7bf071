// The arrays of hull_nodes.h.
#pragma once

#include <cstdint>
#include <vector>

#include "base/array_view_of.h"
#include "fields/hull_nodes.h"

namespace amhex::fields {

// One after the other: most nodes have one constraint of three. On a device they stay with this.
struct OwnedHullNodes {
  std::vector<int32_t> nodes;
  std::vector<int32_t> first{0};
  std::vector<HullConstraint> constraints;
  mutable ResidentSlot there;

  HullNodes View() const {
    return {ArrayViewOf(nodes), ArrayViewOf(first), ArrayViewOf(constraints), &there};
  }
};

}  // namespace amhex::fields
