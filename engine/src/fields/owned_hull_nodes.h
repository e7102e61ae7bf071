// The arrays of hull_nodes.h.
#pragma once

#include <cstdint>
#include <vector>

#include "fields/hull_nodes.h"

namespace amhex::fields {

// One after the other: most nodes have one constraint of three. On a device they stay with this.
struct OwnedHullNodes {
  std::vector<int32_t> nodes;
  std::vector<int32_t> first{0};
  std::vector<HullConstraint> constraints;
  mutable ResidentSlot there;

  HullNodes View() const {
    const auto view = [](const auto& values) {
      return ArrayView{values.data(), static_cast<int64_t>(values.size())};
    };
    return {view(nodes), view(first), view(constraints), &there};
  }
};

}  // namespace amhex::fields
