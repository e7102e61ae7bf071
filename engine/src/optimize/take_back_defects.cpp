#include "optimize/take_back_defects.h"

#include <algorithm>
#include <cstdint>

#include "closure/boundary_defects.h"

namespace amhex {

void TakeBackDefects(const Hull& hull, const std::vector<Vec3d>& before, const StopPoll& poll,
                     CellComplex* complex) {
  constexpr double kNearDefect = 3.0;
  for (;;) {
    std::vector<int32_t> moved;
    for (size_t v = 0; v < before.size(); ++v) {
      if (complex->vertices[v] != before[v]) moved.push_back(static_cast<int32_t>(v));
    }
    if (moved.empty()) return;
    const std::vector<int32_t> defects =
        FindBoundaryDefectsNear(moved, *complex, hull, poll).vertices;
    if (defects.empty()) return;
    bool any = false;
    for (const int32_t v : moved) {
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
