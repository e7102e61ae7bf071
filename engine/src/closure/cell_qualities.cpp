#include "closure/cell_qualities.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "optimize/cell_quality.h"

namespace amhex {

std::vector<double> CellQualities(const WorkingMesh& mesh, const std::vector<int>& only,
                                  const StopPoll& poll) {
  constexpr int kCellsAtOnce = 1024;  // by one thread; excerpts have fewer
  std::vector<double> qualities(mesh.cell_slots(), 1);
  oneapi::tbb::parallel_for(
      oneapi::tbb::blocked_range<int>(0, mesh.cell_slots(), kCellsAtOnce),
      [&](const oneapi::tbb::blocked_range<int>& range) {
        poll.Now();
        for (int cell = range.begin(); cell < range.end(); ++cell) {
          const bool is_meant = only.empty() || std::binary_search(only.begin(), only.end(), cell);
          if (!is_meant || !mesh.alive(cell)) continue;
          qualities[cell] = CellQuality(mesh.corners(cell), mesh.vertices());
        }
      });
  return qualities;
}

}  // namespace amhex
