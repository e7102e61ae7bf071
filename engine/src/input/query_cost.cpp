#include "input/query_cost.h"

#include <algorithm>
#include <vector>

namespace amhex {
namespace {

constexpr size_t kTimedProbes = 64;

// The walk of HullView::WindingBySolidAngles without its sums.
int64_t WindingSteps(const HullView& view, const Vec3d& p) {
  std::vector<int32_t> waiting = {0};
  int64_t steps = 0;
  while (!waiting.empty()) {
    const int32_t id = waiting.back();
    waiting.pop_back();
    ++steps;
    const HullDipole& dipole = view.dipoles.data[id];
    if (SquaredNorm(dipole.centre - p) > dipole.far_squared) continue;
    const HullNode& node = view.nodes.data[id];
    if (node.right >= 0) {
      waiting.push_back(node.right);
      waiting.push_back(id + 1);
    } else {
      steps += node.end - node.begin;
    }
  }
  return steps;
}

}  // namespace

double MeanWindingSteps(const HullView& view) {
  if (view.nodes.empty()) return 0;
  const auto count = static_cast<size_t>(view.triangles.size);
  const size_t stride = std::max<size_t>(1, count / kTimedProbes);
  int64_t steps = 0, probes = 0;
  for (size_t i = 0; i < count; i += stride, ++probes) {
    steps += WindingSteps(view, view.triangles.data[i].a);
  }
  return static_cast<double>(steps) / static_cast<double>(probes);
}

}  // namespace amhex
