// The links of linear_operators.h for a level of the background grid.
#pragma once

#include <cstdint>
#include <vector>

#include "fields/background_grid.h"
#include "fields/linear_operators.h"
#include "fields/orientation_field.h"

namespace amhex::fields {

// The rotations of octahedral_group.h.
ArrayView<const AxisRenaming> RenamingsByCode();

// Owns what the grid does not hold in this form; `codes` must outlive this.
class OwnedLinks {
 public:
  OwnedLinks(const GridLevel& level, const ForwardCodes& codes, const RunContext& run);
  NodeLinks View() const;

 private:
  std::vector<int32_t> neighbours_;
  const ForwardCodes& codes_;
};

}  // namespace amhex::fields
