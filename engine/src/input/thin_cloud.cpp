#include "input/thin_cloud.h"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/sort_polling.h"

namespace amhex {
namespace {

// Cube and main direction.
using Key = std::array<int64_t, 4>;

int64_t MainDirection(const Vec3d& normal) {
  const double x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
  if (x >= y && x >= z) return normal.x < 0 ? 0 : 1;
  if (y >= z) return normal.y < 0 ? 2 : 3;
  return normal.z < 0 ? 4 : 5;
}

int64_t CubeCoordinate(double x, double cell) { return static_cast<int64_t>(std::floor(x / cell)); }

}  // namespace

int64_t ThinCloud(double cell, PointCloud& cloud, const StopPoll& poll) {
  const bool has_normals = !cloud.normals.empty();
  std::vector<std::pair<Key, int32_t>> keys(cloud.points.size());
  for (size_t i = 0; i < keys.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    const Vec3d& p = cloud.points[i];
    keys[i] = {{CubeCoordinate(p.x, cell), CubeCoordinate(p.y, cell), CubeCoordinate(p.z, cell),
                has_normals ? MainDirection(cloud.normals[i]) : 0},
               static_cast<int32_t>(i)};
  }
  ParallelSortPolling(keys.begin(), keys.end(), poll);
  PointCloud thinned;
  for (size_t i = 0; i < keys.size();) {
    Vec3d position, normal;
    double count = 0;
    const Key key = keys[i].first;
    for (; i < keys.size() && keys[i].first == key; ++i, ++count) {
      poll.At(static_cast<int64_t>(i));
      const auto point = static_cast<size_t>(keys[i].second);
      position += cloud.points[point];
      // Unit vectors, so that long normals do not outvote the others.
      if (has_normals) normal += Normalized(cloud.normals[point]);
    }
    thinned.points.push_back(position / count);
    if (has_normals) thinned.normals.push_back(normal / count);
  }
  const auto taken = static_cast<int64_t>(cloud.points.size() - thinned.points.size());
  cloud = std::move(thinned);
  return taken;
}

}  // namespace amhex
