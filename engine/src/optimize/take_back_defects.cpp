#include "optimize/take_back_defects.h"

#include <algorithm>

#include "closure/boundary_defects.h"
#include "closure/working_mesh.h"

namespace amhex {

void TakeBackDefects(const Hull& hull, const std::vector<Vec3d>& before, const StopPoll& poll,
                     CellComplex* complex) {
  constexpr double kNearDefect = 3.0;
  while (complex->vertices != before) {
    const std::vector<int32_t> defects =
        FindBoundaryDefects(WorkingMesh(*complex, poll), hull, poll).vertices;
    if (defects.empty()) return;
    bool any = false;
    for (size_t v = 0; v < before.size(); ++v) {
      if (complex->vertices[v] == before[v]) continue;
      const bool is_near = std::any_of(defects.begin(), defects.end(), [&](int32_t defect) {
        return Norm(before[defect] - before[v]) < kNearDefect;
      });
      if (!is_near) continue;
      complex->vertices[v] = before[v];
      any = true;
    }
    if (!any) complex->vertices = before;
  }
}

}  // namespace amhex
