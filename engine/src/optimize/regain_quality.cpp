#include "optimize/regain_quality.h"

#include <algorithm>

#include "base/status_macros.h"
#include "optimize/raise_average.h"
#include "optimize/raise_jointly.h"
#include "optimize/raise_quality.h"

namespace amhex {
namespace {

constexpr int kSweeps = 10;

}  // namespace

std::vector<uint8_t> BoundaryVertices(const Placement& placement) {
  std::vector<uint8_t> is_boundary(placement.complex.vertices.size(), 0);
  for (size_t v = 0; v < is_boundary.size(); ++v) {
    const auto faces = placement.neighbourhoods.hull_faces[static_cast<int64_t>(v)];
    is_boundary[v] = faces.size() > 0 ? 1 : 0;
  }
  return is_boundary;
}

absl::Status RegainQuality(Placement& placement, const std::vector<uint8_t>& moved,
                           const std::vector<uint8_t>& stays, double floor, const RunContext& run) {
  const std::vector<VertexConstraint> constraints = placement.constraints.vertex;
  SweepMemory memory = StartSweeps(static_cast<int64_t>(moved.size()));
  memory.active.Clear();
  std::vector<int32_t> moved_ones;
  for (size_t v = 0; v < moved.size(); ++v) {
    if (moved[v] != 0) moved_ones.push_back(static_cast<int32_t>(v));
  }
  NoteMoves(moved_ones, placement, memory, StopPoll(run));
  for (size_t v = 0; v < stays.size(); ++v) {
    if (stays[v] != 0) placement.constraints.vertex[v] = {Constraint::kFixed, -1, -1, -1};
  }
  AMHEX_RETURN_IF_ERROR(RunSweeps(placement,
                                  {QualityAim::kAverage, kAverageTarget, floor, kClosestBound},
                                  kSweeps, memory, run));
  RaiseJointly(placement, kJointlyWanted, run);
  placement.constraints.vertex = constraints;
  return run.CheckStop();
}

}  // namespace amhex
