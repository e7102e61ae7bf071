#include "optimize/hull_samples.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "absl/container/flat_hash_map.h"
#include "base/loop_polling.h"
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
constexpr size_t kPointsPerBlock = 512;

using Cube = std::array<int32_t, 3>;

Cube CubeAt(const Vec3d& p) {
  Cube cube;
  for (int a = 0; a < 3; ++a) cube[a] = static_cast<int32_t>(std::floor(p[a] / kPointSpacing));
  return cube;
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

HullPoints::HullPoints(const Hull& hull, bool points_scatter, const StopPoll& poll) : hull_(hull) {
  const double free = LimitsFor(hull).free;
  std::vector<uint8_t> counts(hull.input_points.size(), 1);
  if (points_scatter) {
    ForAllPolling(counts.size(), kPointsPerBlock, poll, [&](size_t i) {
      counts[i] = hull.queries->IsWithin(hull.input_points[i], free) ? 1 : 0;
    });
  }
  absl::flat_hash_map<Cube, int32_t> numbers;
  for (size_t i = 0; i < counts.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    if (counts[i] == 0) continue;
    const auto next = static_cast<int32_t>(numbers.size());
    cube_of_.push_back(numbers.try_emplace(CubeAt(hull.input_points[i]), next).first->second);
    input_points_.push_back(static_cast<int32_t>(i));
  }
  cube_count_ = numbers.size();
  for (const Vec3d& p : SampleSurface(hull.vertices, hull.triangles, kSampleSpacing)) {
    if (!numbers.contains(CubeAt(p))) elsewhere_.push_back(p);
  }
}

std::vector<Vec3d> HullPoints::Against(const HullQueries& boundary, const StopPoll& poll,
                                       const Surroundings& around) const {
  const double limit = LimitsFor(hull_).limit;
  // The input's own points are on ridges and tips: of those in each cube the farthest, and all that
  // are too far, which have to be seen to come nearer one by one.
  const std::vector<int32_t> asked = Within(around);
  const std::vector<double> distances = DistancesTo(boundary, asked, poll);
  std::vector<int32_t> farthest(cube_count_, -1);  // [cube] indices of distances
  std::vector<int32_t> kept;
  for (size_t i = 0; i < asked.size(); ++i) {
    int32_t& own = farthest[static_cast<size_t>(cube_of_[static_cast<size_t>(asked[i])])];
    if (own < 0 || distances[i] > distances[static_cast<size_t>(own)])
      own = static_cast<int32_t>(i);
    if (distances[i] > limit) kept.push_back(static_cast<int32_t>(i));
  }
  std::copy_if(farthest.begin(), farthest.end(), std::back_inserter(kept),
               [](int32_t i) { return i >= 0; });
  SortUnique(kept);
  std::vector<Vec3d> points;
  points.reserve(kept.size() + (around.IsEverywhere() ? elsewhere_.size() : 0));
  std::copy_if(elsewhere_.begin(), elsewhere_.end(), std::back_inserter(points),
               [&](const Vec3d& p) { return around.Contain(p); });
  for (const int32_t i : kept) points.push_back(InputPoint(asked[static_cast<size_t>(i)]));
  return points;
}

// Numbers of those that count, ascending.
std::vector<int32_t> HullPoints::Within(const Surroundings& around) const {
  std::vector<int32_t> within;
  within.reserve(around.IsEverywhere() ? input_points_.size() : 0);
  for (size_t k = 0; k < input_points_.size(); ++k) {
    const auto number = static_cast<int32_t>(k);
    if (around.Contain(InputPoint(number))) within.push_back(number);
  }
  return within;
}

// How far each of these is from the boundary where that counts, else 0.
std::vector<double> HullPoints::DistancesTo(const HullQueries& boundary,
                                            const std::vector<int32_t>& of,
                                            const StopPoll& poll) const {
  const double free = LimitsFor(hull_).free;
  std::vector<double> distances(of.size(), 0);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, distances.size(), kPointsPerBlock),
                    [&](const tbb::blocked_range<size_t>& range) {
                      poll.Now();
                      int32_t likely = -1;
                      for (size_t i = range.begin(); i < range.end(); ++i) {
                        const Vec3d& p = InputPoint(of[i]);
                        if (boundary.IsWithin(p, free, likely)) continue;
                        distances[i] = boundary.Closest(p, likely).distance;
                      }
                    });
  return distances;
}

std::vector<Vec3d> CreasePoints(const FeatureView& features, const Surroundings& around) {
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
        const Vec3d p = segment.first + along * ((k + 0.5) / count);
        if (around.Contain(p)) points.push_back(p);
      }
    }
  }
  return points;
}

}  // namespace amhex
