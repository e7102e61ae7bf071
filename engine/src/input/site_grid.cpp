#include "input/site_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/counter_rng.h"
#include "base/platform.h"
#include "base/status_macros.h"
#include "exec/cpu_executor.h"
#include "graph/grid_bins.h"
#include "graph/hop_distance.h"
#include "graph/knn_exact_body.h"
#include "input/hull_queries.h"
#include "relax/thin_samples.h"

namespace amhex {
namespace {

// Layers of cubes around the box: one hop, and one to spare.
constexpr int32_t kMarginLayers = 2;
// Measured: outside sites change nothing in the inside ones but their frames at the hull, at the
// cost of one inside site each; the Outlook's bound of one hop loses nothing.
constexpr int32_t kFarthestHop = 1;
// Nor farther than this, edge lengths: at the rim of the box the neighbours of a site all lie on
// one side, and its hops are longer.
constexpr double kFarthestDistance = 1.25;
// Cubes over the box; more means a box absurdly larger than what it holds.
constexpr double kMaxCubes = 1 << 28;
// Cubes are judged together, this many along each axis, where the hull is far from all of them.
constexpr int32_t kGroupWidth = 4;
constexpr float kBinSize = 1.0f;

enum class Side : uint8_t { kDropped, kOutside, kInside };

struct CubeGrid {
  int32_t count_x = 0;
  int32_t count_y = 0;
  int32_t count_z = 0;
  Vec3d low;  // of the first cube

  int64_t size() const { return static_cast<int64_t>(count_x) * count_y * count_z; }
  int64_t IndexOf(int32_t x, int32_t y, int32_t z) const {
    return (static_cast<int64_t>(z) * count_y + y) * count_x + x;
  }
  Vec3d CentreOf(int64_t index) const {
    const int64_t row = index / count_x, layer = row / count_y;
    const auto x = static_cast<double>(index % count_x);
    const auto y = static_cast<double>(row % count_y);
    return low + Vec3d{x + 0.5, y + 0.5, static_cast<double>(layer) + 0.5};
  }
};

absl::StatusOr<CubeGrid> StackCubes(const Box3d& box) {
  const Vec3d extent = box.Extent();
  const auto along = [](double length) {
    return std::max(1.0, std::round(length)) + 2 * kMarginLayers;
  };
  const Vec3d count = {along(extent.x), along(extent.y), along(extent.z)};
  if (!(count.x * count.y * count.z <= kMaxCubes)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("sizing: the input's box holds ", count.x * count.y * count.z,
                     " cubes of the wanted edge length, limit ", kMaxCubes));
  }
  CubeGrid grid{static_cast<int32_t>(count.x),
                static_cast<int32_t>(count.y),
                static_cast<int32_t>(count.z),
                {}};
  grid.low = (box.low + box.high) * 0.5 - count * 0.5;
  return grid;
}

Vec3d Jitter(const MeshingParams& params, int64_t index) {
  if (params.relaxation.initialization != Initialization::kJitteredGrid) return {};
  const auto offset = [&](uint64_t axis) {
    const double unit = RandomUnit(params.run.seed, RandomStream::kGridJitter,
                                   3 * static_cast<uint64_t>(index) + axis);
    return params.relaxation.jitter * (2 * unit - 1);
  };
  return {offset(0), offset(1), offset(2)};
}

Side SideOf(const Hull& hull, const Vec3d& p) {
  if (hull.queries->IsInside(p)) return Side::kInside;
  return hull.queries->Closest(p, kFarthestDistance).triangle < 0 ? Side::kDropped : Side::kOutside;
}

// Judges the sites of the cubes from `first` on, kGroupWidth along each axis.
void JudgeGroup(const Hull& hull, const MeshingParams& params, const CubeGrid& grid,
                const std::array<int32_t, 3>& first, std::vector<Side>& side) {
  const std::array<int32_t, 3> last = {std::min(first[0] + kGroupWidth, grid.count_x),
                                       std::min(first[1] + kGroupWidth, grid.count_y),
                                       std::min(first[2] + kGroupWidth, grid.count_z)};
  // All sites lie within their cubes, hence within this distance of the group's centre.
  const double radius = 0.5 * kGroupWidth * std::sqrt(3.0);
  const Vec3d centre = grid.low + Vec3d{first[0] + 0.5 * kGroupWidth, first[1] + 0.5 * kGroupWidth,
                                        first[2] + 0.5 * kGroupWidth};
  const bool is_far = hull.queries->Closest(centre, radius + kFarthestDistance).triangle < 0;
  const Side common = is_far && hull.queries->IsInside(centre) ? Side::kInside : Side::kDropped;
  for (int32_t z = first[2]; z < last[2]; ++z) {
    for (int32_t y = first[1]; y < last[1]; ++y) {
      for (int32_t x = first[0]; x < last[0]; ++x) {
        const int64_t index = grid.IndexOf(x, y, z);
        side[static_cast<size_t>(index)] =
            is_far ? common : SideOf(hull, grid.CentreOf(index) + Jitter(params, index));
      }
    }
  }
}

absl::StatusOr<std::vector<Side>> JudgeSites(const Hull& hull, const MeshingParams& params,
                                             const CubeGrid& grid, const RunContext& run) {
  std::vector<Side> side(static_cast<size_t>(grid.size()), Side::kDropped);
  const auto groups = [](int32_t count) { return (count + kGroupWidth - 1) / kGroupWidth; };
  const int32_t groups_x = groups(grid.count_x);
  const int32_t groups_y = groups(grid.count_y);
  const int64_t group_count = int64_t{groups_x} * groups_y * groups(grid.count_z);
  tbb::parallel_for(int64_t{0}, group_count, [&](int64_t group) {
    if (run.ShouldStop()) return;
    const std::array<int32_t, 3> first = {
        kGroupWidth * static_cast<int32_t>(group % groups_x),
        kGroupWidth * static_cast<int32_t>(group / groups_x % groups_y),
        kGroupWidth * static_cast<int32_t>(group / groups_x / groups_y)};
    JudgeGroup(hull, params, grid, first, side);
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  return side;
}

// Hop distance of every position to the samples, eq. 2 over N_26 of both.
std::vector<int32_t> HopsToHull(const std::vector<Vec3d>& position, const HullSamples& samples,
                                const CubeGrid& grid) {
  const HullSamples thinned = ThinSamples(samples);
  std::vector<Vec3f> nodes;
  nodes.reserve(position.size() + thinned.position.size());
  for (const Vec3d& p : position) nodes.push_back(ToFloat(p - grid.low));
  for (const Vec3d& p : thinned.position) nodes.push_back(ToFloat(p - grid.low));
  const auto site_count = static_cast<int64_t>(position.size());
  const auto node_count = static_cast<int64_t>(nodes.size());
  CpuExecutor executor;
  const Vec3d extent = {static_cast<double>(grid.count_x), static_cast<double>(grid.count_y),
                        static_cast<double>(grid.count_z)};
  GridBins<CpuExecutor> bins(executor, extent, kBinSize);
  const ArrayView<const Vec3f> node_view{nodes.data(), node_count};
  HostBuffer<int32_t> neighbours = executor.Alloc<int32_t>(site_count * kNeighbourCount);
  executor.ForEach("find neighbours", site_count,
                   KnnExactBody{bins.Build(node_view, node_count), node_view, neighbours.View()});
  const HostBuffer<int32_t> hops =
      ComputeHopDistance(executor, ReadOnly(neighbours.View()), site_count, node_count);
  std::vector<int32_t> result(position.size());
  executor.CopyOut(hops, site_count, result.data());
  return result;
}

}  // namespace

absl::StatusOr<Sites> PopulateGrid(const Hull& hull, const HullSamples& samples,
                                   const MeshingParams& params, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(const CubeGrid grid, StackCubes(hull.box));
  AMHEX_ASSIGN_OR_RETURN(const std::vector<Side> side, JudgeSites(hull, params, grid, run));
  std::vector<Vec3d> position;
  std::vector<Side> kept_side;
  for (int64_t index = 0; index < grid.size(); ++index) {
    const Side s = side[static_cast<size_t>(index)];
    if (s == Side::kDropped) continue;
    position.push_back(grid.CentreOf(index) + Jitter(params, index));
    kept_side.push_back(s);
  }
  if (std::count(kept_side.begin(), kept_side.end(), Side::kInside) == 0) {
    return absl::InvalidArgumentError(
        "sizing: no grid site falls inside the input; its walls are thinner than the wanted edge "
        "length, ask for more cells");
  }
  const std::vector<int32_t> hops = HopsToHull(position, samples, grid);
  Sites sites;
  for (size_t i = 0; i < position.size(); ++i) {
    if (kept_side[i] == Side::kOutside && hops[i] > kFarthestHop) continue;
    sites.position.push_back(position[i]);
    sites.frame.emplace_back();
    sites.size.push_back({1, 1, 1});
    sites.cell_volume.push_back(0.0);
  }
  Progress progress = run.progress();
  progress.site_count = sites.count();
  run.Report(progress);
  return sites;
}

}  // namespace amhex
