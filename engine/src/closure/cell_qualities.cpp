#include "closure/cell_qualities.h"

#include <algorithm>

#include "base/loop_polling.h"
#include "optimize/cell_quality.h"

namespace amhex {

std::vector<double> CellQualities(const WorkingMesh& mesh, const std::vector<int>& only,
                                  const StopPoll& poll) {
  constexpr size_t kCellsAtOnce = 1024;  // by one thread; excerpts have fewer
  std::vector<double> qualities(mesh.cell_slots(), 1);
  ForAllPolling(qualities.size(), kCellsAtOnce, poll, [&](size_t slot) {
    const int cell = static_cast<int>(slot);
    const bool is_meant = only.empty() || std::binary_search(only.begin(), only.end(), cell);
    if (!is_meant || !mesh.alive(cell)) return;
    qualities[slot] = CellQuality(mesh.corners(cell), mesh.vertices());
  });
  return qualities;
}

}  // namespace amhex
