#include "fields/background_grid.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"

namespace amhex::fields {
namespace {

constexpr int kMaxDepth = 20;  // cells along an axis: 2^20; keys then fit into 60 bits
constexpr int64_t kMaxNodes = (int64_t{1} << 31) - 1;
// A side that is a whole number of cells but for rounding gets exactly that number.
constexpr double kRoundingSlack = 1e-6;

}  // namespace

Vec3d BackgroundGrid::Position(int64_t node) const {
  return CentreOfCell(fine().key[node], origin, spacing);
}

absl::StatusOr<BackgroundGrid> BuildBackgroundGrid(const Hull& hull, double spacing,
                                                   const ProgressSlice& slice, DeviceUse* device) {
  BackgroundGrid grid;
  grid.spacing = spacing;
  const Vec3d extent = hull.box.Extent();
  int depth = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = std::max(1.0, std::ceil(extent[axis] / grid.spacing - kRoundingSlack));
    if (!(cells <= std::ldexp(1.0, kMaxDepth))) {
      return absl::ResourceExhaustedError(absl::StrCat("the hull spans ", extent[axis],
                                                       " edge lengths; the limit is ",
                                                       std::ldexp(grid.spacing, kMaxDepth)));
    }
    while (std::ldexp(1.0, depth) < cells) ++depth;
    grid.origin[axis] = (hull.box.low[axis] + hull.box.high[axis] - cells * grid.spacing) / 2;
  }
  const RunContext& run = slice.run();
  const HullAsker asker(*hull.queries, device, StopPoll(run));
  absl::StatusOr<std::vector<uint64_t>> cells =
      FindInsideCells(asker, grid.origin, grid.spacing, depth);
  if (!cells.ok()) return cells.status();
  const auto node_count = static_cast<int64_t>(cells->size());
  if (node_count == 0) {
    return absl::InvalidArgumentError(
        "sizing: the hull is thinner than half an edge length everywhere: ask for more cells");
  }
  if (node_count > kMaxNodes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the background grid needs ", node_count, " nodes; the limit is ", kMaxNodes));
  }
  grid.levels.emplace_back().key = *std::move(cells);
  slice.Report(0.5);
  if (absl::Status s = FindHullConstraints(asker, &grid); !s.ok()) return s;
  if (absl::Status s = FindGuideDirections(hull.guidance, &grid, run); !s.ok()) return s;
  slice.Report(0.8);
  if (absl::Status s = BuildPyramid(&grid, run); !s.ok()) return s;
  slice.Report(1.0);
  return grid;
}

}  // namespace amhex::fields
