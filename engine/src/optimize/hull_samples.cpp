#include "optimize/hull_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "absl/container/flat_hash_map.h"
#include "base/sort_unique.h"
#include "optimize/hull_deviation.h"
#include "output/surface_distance.h"

namespace amhex {
namespace {

// As the statistics of a result have it (output/mesh_statistics, output/sharp_edges).
constexpr double kSampleSpacing = 1.0 / 3.0;
constexpr double kPointSpacing = 1.0 / 3.0;
constexpr double kCreaseSpacing = 0.25;
// Of a larger share of points off the hull, they scatter: .45 of two clouds with noise, .02 and
// less of scans and clouds without.
constexpr double kScatteringShare = 0.1;
constexpr size_t kPointsAsked = 4096;  // at least, if there are so many

using Cube = std::array<int32_t, 3>;

Cube CubeAt(const Vec3d& p) {
  Cube cube;
  for (int a = 0; a < 3; ++a) cube[a] = static_cast<int32_t>(std::floor(p[a] / kPointSpacing));
  return cube;
}

// [point] how far each is from the boundary where that counts, else 0.
std::vector<double> DistancesOf(const std::vector<Vec3d>& points, double free,
                                const HullQueries& boundary, const StopPoll& poll) {
  std::vector<double> distances(points.size(), 0);
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    poll.At(static_cast<int64_t>(i));
    if (!boundary.IsWithin(points[i], free)) distances[i] = boundary.Closest(points[i]).distance;
  });
  return distances;
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
  const double limit = LimitsFor(hull).limit, free = LimitsFor(hull).free;
  // The input's own points are on ridges and tips: of those in each cube of a grid the farthest,
  // and all that are too far, which have to be seen to come nearer one by one.
  const std::vector<double> distances = DistancesOf(hull.input_points, free, boundary, poll);
  absl::flat_hash_map<Cube, size_t> farthest;
  std::vector<size_t> kept;
  for (size_t i = 0; i < hull.input_points.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    const Vec3d& p = hull.input_points[i];
    if (points_scatter && !hull.queries->IsWithin(p, free)) continue;
    const auto [at, is_first] = farthest.try_emplace(CubeAt(p), i);
    if (!is_first && distances[i] > distances[at->second]) at->second = i;
    if (distances[i] > limit) kept.push_back(i);
  }
  std::vector<Vec3d> points;
  for (const Vec3d& p : SampleSurface(hull.vertices, hull.triangles, kSampleSpacing)) {
    if (!farthest.contains(CubeAt(p))) points.push_back(p);
  }
  for (const auto& [cube, i] : farthest) kept.push_back(i);
  SortUnique(kept);
  for (const size_t i : kept) points.push_back(hull.input_points[i]);
  return points;
}

std::vector<Vec3d> CreasePoints(const FeatureView& features) {
  std::vector<Vec3d> points;
  for (int64_t c = 0; c < features.creases.size; ++c) {
    const ArrayView<const LineSegment> segments = features.creases[c].segments.segments;
    // Of short segments, one falls due whenever their lengths complete another share.
    double due = kCreaseSpacing / 2;
    for (int64_t i = 0; i < segments.size; ++i) {
      const LineSegment& segment = segments[i];
      const Vec3d along = segment.second - segment.first;
      const double length = Norm(along);
      if (length < kCreaseSpacing) {
        due -= length;
        if (due > 0) continue;
        due += kCreaseSpacing;
      }
      const int count = std::max(1, static_cast<int>(std::ceil(length / kCreaseSpacing)));
      for (int k = 0; k < count; ++k) {
        points.push_back(segment.first + along * ((k + 0.5) / count));
      }
    }
  }
  return points;
}

}  // namespace amhex
