#include "output/measure_cells.h"

#include <utility>

#include "base/status_error.h"
#include "cuda/device_use.h"
#include "exec/cpu_executor.h"
#include "output/measure_cells_task.h"

namespace amhex {

std::vector<CellMeasures> MeasureCells(const std::vector<CellCorners>& corners,
                                       const std::vector<Vec3d>& vertices, const StopPoll& poll,
                                       DeviceUse* device) {
  // On a device fewer cost more than they save (a guess, as in input/ask_hull.h).
  constexpr size_t kFewestForDevice = 512;
  const auto count = static_cast<int64_t>(corners.size());
  MeasureCellsTask task{
      {{corners.data(), count}, {vertices.data(), static_cast<int64_t>(vertices.size())}},
      {},
      [&poll] { return poll.IsToStop(); }};
  const auto on_cpu = [&task, count] {
    CpuExecutor executor(task.should_stop);
    task.measures.resize(static_cast<size_t>(count));
    executor.ForEach("measure cells", count,
                     MeasureCellBody{task.cells, {task.measures.data(), count}});
    return !executor.Stopped();
  };
  DeviceUse* const where = corners.size() < kFewestForDevice ? nullptr : device;
  const absl::StatusOr<bool> is_done = RunWhereChosen(where, &task, on_cpu);
  poll.Now();
  if (!is_done.ok()) throw StatusError(is_done.status());
  return std::move(task.measures);
}

}  // namespace amhex
