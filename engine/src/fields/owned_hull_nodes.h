// The arrays of hull_nodes.h of a background grid.
#pragma once

#include <cstdint>
#include <vector>

#include "fields/background_grid.h"
#include "fields/hull_nodes.h"

namespace amhex::fields {

// One after the other: most nodes have one constraint of three. On a device they stay with this.
class OwnedHullNodes {
 public:
  OwnedHullNodes() = default;
  explicit OwnedHullNodes(const GridLevel& level) : nodes_(level.constraints.size()) {
    for (int64_t i = 0; i < level.count(); ++i) {
      const int32_t k = level.constraint_of_node[i];
      if (k >= 0) nodes_[k] = static_cast<int32_t>(i);
    }
    first_.reserve(nodes_.size() + 1);
    for (const HullConstraints& of_node : level.constraints) {
      constraints_.insert(constraints_.end(), of_node.begin(), of_node.end());
      first_.push_back(static_cast<int32_t>(constraints_.size()));
    }
  }
  HullNodes View() const {
    const auto view = [](const auto& values) {
      return ArrayView{values.data(), static_cast<int64_t>(values.size())};
    };
    return {view(nodes_), view(first_), view(constraints_), &resident_};
  }

 private:
  std::vector<int32_t> nodes_, first_{0};
  std::vector<HullConstraint> constraints_;
  mutable ResidentSlot resident_;
};

}  // namespace amhex::fields
