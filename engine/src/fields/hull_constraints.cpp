// What the hull demands of the nodes next to it.
#include "base/status_macros.h"
#include "fields/background_grid.h"

namespace amhex::fields {

absl::Status FindHullConstraints(const HullAsker& hull, BackgroundGrid* grid) {
  GridLevel& level = grid->levels.front();
  const CellCentres nodes = grid->Cells();
  AMHEX_ASSIGN_OR_RETURN(const std::vector<uint8_t> is_near,
                         hull.Ask(IsNear<CellCentres>{nodes, kHullReach * grid->spacing}));
  std::vector<uint64_t> near_keys;
  level.constraint_of_node.assign(is_near.size(), -1);
  for (size_t i = 0; i < is_near.size(); ++i) {
    if (is_near[i] == 0) continue;
    level.constraint_of_node[i] = static_cast<int32_t>(near_keys.size());
    near_keys.push_back(level.key[i]);
  }
  AMHEX_ASSIGN_OR_RETURN(
      level.constraints,
      hull.Ask(ConstraintsOf{CentresOf(near_keys, grid->origin, grid->spacing)}));
  return absl::OkStatus();
}

}  // namespace amhex::fields
