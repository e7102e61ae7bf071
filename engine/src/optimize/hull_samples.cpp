#include "optimize/hull_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "absl/container/flat_hash_set.h"
#include "optimize/hull_deviation.h"
#include "output/surface_distance.h"

namespace amhex {
namespace {

// As the statistics of a result have it (output/mesh_statistics, output/sharp_edges).
constexpr double kSampleSpacing = 1.0 / 3.0;
constexpr double kPointSpacing = 0.25;
constexpr double kCreaseSpacing = 0.25;
// Of a larger share of points off the hull, they scatter: .45 of two clouds with noise, .02 and
// less of scans and clouds without.
constexpr double kScatteringShare = 0.1;
constexpr size_t kPointsAsked = 4096;  // at least, if there are so many

// [point] 1 where an input point is farther than `distance` from the boundary.
std::vector<uint8_t> AreBeyond(double distance, const Hull& hull, const HullQueries& boundary,
                               const StopPoll& poll) {
  std::vector<uint8_t> beyond(hull.input_points.size());
  tbb::parallel_for(size_t{0}, beyond.size(), [&](size_t i) {
    poll.At(static_cast<int64_t>(i));
    beyond[i] = boundary.IsWithin(hull.input_points[i], distance) ? 0 : 1;
  });
  return beyond;
}

}  // namespace

bool PointsScatter(const Hull& hull, const StopPoll& poll) {
  const size_t stride = 1 + hull.input_points.size() / (2 * kPointsAsked);
  const double near = LimitsFor(hull).free;
  int64_t asked = 0, off = 0;
  for (size_t i = 0; i < hull.input_points.size(); i += stride) {
    poll.At(++asked);
    if (!hull.queries->IsWithin(hull.input_points[i], near)) ++off;
  }
  return static_cast<double>(off) > kScatteringShare * static_cast<double>(asked);
}

std::vector<Vec3d> HullPoints(const Hull& hull, const HullQueries& boundary, bool points_scatter,
                              const StopPoll& poll) {
  std::vector<Vec3d> points = SampleSurface(hull.vertices, hull.triangles, kSampleSpacing);
  // One of the input's own points in each cube of a grid: they are on ridges and tips. And all
  // that are far away: the very tip may be another one of its cube.
  const std::vector<uint8_t> is_far = AreBeyond(LimitsFor(hull).free, hull, boundary, poll);
  absl::flat_hash_set<std::array<int32_t, 3>> taken;
  for (size_t i = 0; i < hull.input_points.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    const Vec3d& p = hull.input_points[i];
    if (points_scatter && !hull.queries->IsWithin(p, LimitsFor(hull).free)) continue;
    std::array<int32_t, 3> cube;
    for (int a = 0; a < 3; ++a) cube[a] = static_cast<int32_t>(std::floor(p[a] / kPointSpacing));
    if (taken.insert(cube).second || is_far[i]) points.push_back(p);
  }
  return points;
}

std::vector<Vec3d> CreasePoints(const FeatureView& features) {
  std::vector<Vec3d> points;
  for (int64_t c = 0; c < features.creases.size; ++c) {
    const ArrayView<const LineSegment> segments = features.creases[c].segments.segments;
    for (int64_t i = 0; i < segments.size; ++i) {
      const LineSegment& segment = segments[i];
      const Vec3d along = segment.second - segment.first;
      const int count = std::max(1, static_cast<int>(std::ceil(Norm(along) / kCreaseSpacing)));
      for (int k = 0; k < count; ++k) {
        points.push_back(segment.first + along * ((k + 0.5) / count));
      }
    }
  }
  return points;
}

}  // namespace amhex
