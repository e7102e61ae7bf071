#include "output/surface_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace amhex {
namespace {

constexpr double kMaxSampleCount = 1e6;
// The plane's low-discrepancy sequence of the plastic number (Roberts 2018).
constexpr double kPlasticFirst = 0.7548776662466927;
constexpr double kPlasticSecond = 0.5698402909980532;

// The index-th point of a sequence that fills the triangle evenly.
Vec3d PointInTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, int64_t index) {
  const double i = static_cast<double>(index);
  double u = std::fmod(0.5 + i * kPlasticFirst, 1.0);
  double v = std::fmod(0.5 + i * kPlasticSecond, 1.0);
  if (u + v > 1) u = 1 - u, v = 1 - v;
  return a + (b - a) * u + (c - a) * v;
}

}  // namespace

std::vector<Vec3d> SampleSurface(const std::vector<Vec3d>& vertices,
                                 const std::vector<std::array<int32_t, 3>>& triangles,
                                 double spacing) {
  std::vector<double> areas(triangles.size());
  tbb::parallel_for(size_t{0}, triangles.size(), [&](size_t i) {
    const auto& t = triangles[i];
    areas[i] = Norm(Cross(vertices[t[1]] - vertices[t[0]], vertices[t[2]] - vertices[t[0]])) / 2;
  });
  const double total_area = std::accumulate(areas.begin(), areas.end(), 0.0);
  const double area_per_sample = std::max(spacing * spacing, total_area / kMaxSampleCount);
  if (!(area_per_sample > 0)) return {};
  // A sample falls due whenever the area passed so far completes another share.
  std::vector<size_t> first(triangles.size() + 1, 0);  // sample of each triangle
  double due = area_per_sample / 2;
  for (size_t i = 0; i < triangles.size(); ++i) {
    size_t count = 0;
    for (due -= areas[i]; due <= 0; due += area_per_sample) ++count;
    first[i + 1] = first[i] + count;
  }
  std::vector<Vec3d> samples(first.back());
  tbb::parallel_for(size_t{0}, triangles.size(), [&](size_t i) {
    const auto& t = triangles[i];
    for (size_t k = first[i]; k < first[i + 1]; ++k) {
      samples[k] =
          PointInTriangle(vertices[t[0]], vertices[t[1]], vertices[t[2]], static_cast<int64_t>(k));
    }
  });
  return samples;
}

DistanceSummary DistanceToSurface(const std::vector<Vec3d>& points, const HullAsker& surface) {
  const std::vector<double> distances =
      surface.AskOrThrow(DistanceTo<PlainPoints>{PointsOf(points)});
  DistanceSummary summary;
  for (const double distance : distances) {
    summary.maximum = std::max(summary.maximum, distance);
    summary.mean += distance;
  }
  if (!points.empty()) summary.mean /= static_cast<double>(points.size());
  return summary;
}

double FarthestFromSurface(const std::vector<Vec3d>& points, double enough,
                           const HullAsker& surface) {
  const std::vector<double> distances =
      surface.AskOrThrow(DistanceTo<PlainPoints>{PointsOf(points), enough});
  return distances.empty() ? 0.0 : *std::max_element(distances.begin(), distances.end());
}

}  // namespace amhex
