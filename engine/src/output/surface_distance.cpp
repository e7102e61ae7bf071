#include "output/surface_distance.h"

#include <algorithm>
#include <cmath>

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
  const auto area_of = [&](const std::array<int32_t, 3>& t) {
    return Norm(Cross(vertices[t[1]] - vertices[t[0]], vertices[t[2]] - vertices[t[0]])) / 2;
  };
  double total_area = 0;
  for (const auto& t : triangles) total_area += area_of(t);
  const double area_per_sample = std::max(spacing * spacing, total_area / kMaxSampleCount);
  std::vector<Vec3d> samples;
  if (!(area_per_sample > 0)) return samples;
  // A sample falls due whenever the area passed so far completes another share.
  double due = area_per_sample / 2;
  for (const auto& t : triangles) {
    for (due -= area_of(t); due <= 0; due += area_per_sample) {
      samples.push_back(PointInTriangle(vertices[t[0]], vertices[t[1]], vertices[t[2]],
                                        static_cast<int64_t>(samples.size())));
    }
  }
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

}  // namespace amhex
