// What the hull demands of the nodes next to it.
#include <utility>

#include "base/status_macros.h"
#include "exec/cpu_executor.h"
#include "fields/background_grid.h"
#include "fields/hull_nodes_impl.h"
#include "input/hull_queries.h"

namespace amhex::fields {

absl::Status FindHullConstraints(const HullAsker& hull, BackgroundGrid* grid) {
  GridLevel& level = grid->levels.front();
  HullNodesTask task;
  task.cells = grid->Cells();
  task.hull = hull.queries().view_if_here(), task.resident = &hull.queries().resident();
  task.there = &level.at_hull.there;
  task.should_stop = [&hull] { return hull.IsToStop(); };
  const auto on_cpu = [&] {
    CpuExecutor executor(task.should_stop);
    return TakeHullNodes(executor, FindHullNodes(executor, hull.queries().view(), task.cells),
                         task);
  };
  AMHEX_RETURN_IF_ERROR(hull.RunFor(level.count(), &task, on_cpu));
  level.place_at_hull.assign(level.key.size(), -1);
  for (size_t k = 0; k < task.nodes.size(); ++k) {
    level.place_at_hull[task.nodes[k]] = static_cast<int32_t>(k);
  }
  level.at_hull.nodes = std::move(task.nodes), level.at_hull.first = std::move(task.first);
  level.at_hull.constraints = std::move(task.constraints);
  return absl::OkStatus();
}

}  // namespace amhex::fields
