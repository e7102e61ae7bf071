#include "input/drop_strays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/sort_polling.h"

namespace amhex {
namespace {

// A part of a surface that is scanned thirty times less densely than the other half still has a
// point in each cube: half of the 3 g^2 cubes that a surface crosses among g^3.
constexpr double kPointsPerSquaredCubes = 46;
constexpr double kFewestCubes = 4;  // along each axis
constexpr double kMostCubes = 64;
constexpr size_t kLargestGroup = 32;         // points; more may be a body of its own
constexpr double kMostStrays = 0.05;         // of all points
constexpr double kWorthwhileDiagonal = 0.5;  // of the box with strays
// The same where cubes are smaller than that: few points then may be a part that is scanned less
// densely, unless they lie farther out than any part of a body.
constexpr double kFarOutDiagonal = 0.125;

using Indices = std::vector<int32_t>;
using Cube = std::array<int32_t, 3>;

struct OccupiedCube {
  Cube cube;
  int32_t begin = 0, end = 0;  // of the sorted points
  int32_t group = -1;
};

struct CubeGrid {
  Indices points;                   // sorted by cube
  std::vector<OccupiedCube> cubes;  // sorted
};

Box3d BoxOf(const PointCloud& cloud, const Indices& points) {
  Box3d box;
  for (const int32_t i : points) box.Extend(cloud.points[static_cast<size_t>(i)]);
  return box;
}

CubeGrid SortIntoCubes(const PointCloud& cloud, const Indices& points, double cubes_per_axis,
                       const StopPoll& poll) {
  const Box3d box = BoxOf(cloud, points);
  const Vec3d extent = box.Extent();
  const double side = std::max({extent.x, extent.y, extent.z}) / cubes_per_axis;
  std::vector<std::pair<Cube, int32_t>> keys(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    const Vec3d from_low = cloud.points[static_cast<size_t>(points[i])] - box.low;
    for (size_t a = 0; a < 3; ++a) {
      keys[i].first[a] = static_cast<int32_t>(std::floor(from_low[static_cast<int>(a)] / side));
    }
    keys[i].second = points[i];
  }
  ParallelSortPolling(keys.begin(), keys.end(), poll);
  CubeGrid grid;
  for (const auto& [cube, point] : keys) {
    const auto here = static_cast<int32_t>(grid.points.size());
    if (grid.cubes.empty() || grid.cubes.back().cube != cube)
      grid.cubes.push_back({cube, here, here});
    grid.points.push_back(point);
    ++grid.cubes.back().end;
  }
  return grid;
}

OccupiedCube* FindCube(CubeGrid& grid, const Cube& cube) {
  const auto found = std::lower_bound(
      grid.cubes.begin(), grid.cubes.end(), cube,
      [](const OccupiedCube& occupied, const Cube& wanted) { return occupied.cube < wanted; });
  return found == grid.cubes.end() || found->cube != cube ? nullptr : &*found;
}

// Numbers the groups of cubes that touch, at faces, edges or corners. Returns the points of each.
std::vector<size_t> NumberGroups(CubeGrid& grid) {
  std::vector<size_t> sizes;
  std::vector<OccupiedCube*> waiting;
  const auto enter = [&](OccupiedCube* cube) {
    if (cube == nullptr || cube->group >= 0) return;
    cube->group = static_cast<int32_t>(sizes.size()) - 1;
    sizes.back() += static_cast<size_t>(cube->end - cube->begin);
    waiting.push_back(cube);
  };
  for (OccupiedCube& start : grid.cubes) {
    if (start.group >= 0) continue;
    sizes.push_back(0);
    enter(&start);
    while (!waiting.empty()) {
      const Cube at = waiting.back()->cube;
      waiting.pop_back();
      for (int32_t i = 0; i < 27; ++i) {
        enter(FindCube(grid, {at[0] + i % 3 - 1, at[1] + i / 3 % 3 - 1, at[2] + i / 9 - 1}));
      }
    }
  }
  return sizes;
}

// Strays are too few to hold a quantile, so this box without a share at either end of each axis
// lies within the box of all other points: a quick no.
bool MayHaveStrays(const PointCloud& cloud, const StopPoll& poll) {
  const auto share =
      static_cast<std::ptrdiff_t>(kMostStrays * static_cast<double>(cloud.points.size()));
  Vec3d low, high, inner;
  std::vector<double> along(cloud.points.size());
  for (int a = 0; a < 3; ++a) {
    poll.Now();
    std::transform(cloud.points.begin(), cloud.points.end(), along.begin(),
                   [a](const Vec3d& p) { return p[a]; });
    const auto [least, most] = std::minmax_element(along.begin(), along.end());
    low[a] = *least, high[a] = *most;
    const auto first = along.begin() + share, last = along.end() - 1 - share;
    std::nth_element(along.begin(), first, along.end());
    const double begin = *first;
    std::nth_element(along.begin(), last, along.end());
    inner[a] = *last - begin;
  }
  return Norm(inner) <= kWorthwhileDiagonal * Norm(high - low);
}

// The points of the larger groups.
Indices InLargeGroups(CubeGrid grid) {
  const std::vector<size_t> sizes = NumberGroups(grid);
  Indices kept;
  for (const OccupiedCube& cube : grid.cubes) {
    if (sizes[static_cast<size_t>(cube.group)] <= kLargestGroup) continue;
    kept.insert(kept.end(), grid.points.begin() + cube.begin, grid.points.begin() + cube.end);
  }
  return kept;
}

// The points without the strays that inflate their box; all of them where there are none.
Indices WithoutStrays(const PointCloud& cloud, Indices points, size_t fewest,
                      const StopPoll& poll) {
  const double diagonal = BoxOf(cloud, points).Diagonal();
  double share = kWorthwhileDiagonal;
  double cubes = std::clamp(std::sqrt(static_cast<double>(points.size()) / kPointsPerSquaredCubes),
                            kFewestCubes, kMostCubes);
  for (; cubes <= kMostCubes && diagonal > 0; cubes *= 2, share = kFarOutDiagonal) {
    Indices kept = InLargeGroups(SortIntoCubes(cloud, points, cubes, poll));
    if (kept.size() < std::max<size_t>(1, fewest)) break;
    if (BoxOf(cloud, kept).Diagonal() <= share * diagonal) return kept;
  }
  return points;
}

PointCloud Select(const PointCloud& cloud, const Indices& points) {
  PointCloud selected;
  for (const int32_t i : points) {
    selected.points.push_back(cloud.points[static_cast<size_t>(i)]);
    if (!cloud.normals.empty()) selected.normals.push_back(cloud.normals[static_cast<size_t>(i)]);
  }
  return selected;
}

}  // namespace

std::optional<PointCloud> DropStrays(const PointCloud& cloud, const StopPoll& poll) {
  if (cloud.points.empty() || !MayHaveStrays(cloud, poll)) return std::nullopt;
  const auto fewest_kept =
      static_cast<size_t>(std::ceil((1 - kMostStrays) * static_cast<double>(cloud.points.size())));
  Indices kept(cloud.points.size());
  for (size_t i = 0; i < kept.size(); ++i) kept[i] = static_cast<int32_t>(i);
  for (size_t before = 0; kept.size() != before;) {
    before = kept.size();
    kept = WithoutStrays(cloud, std::move(kept), fewest_kept, poll);
  }
  if (kept.size() == cloud.points.size()) return std::nullopt;
  std::sort(kept.begin(), kept.end());
  return Select(cloud, kept);
}

}  // namespace amhex
