#include "input/even_normals.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/status_macros.h"

namespace amhex {
namespace {

// Planes through few noisy points stand anyhow: normals are then averaged over more of them, the
// nearer and the more alike the more. Chords between unit normals tell how alike; the width is
// this many times what those of the 16th nearest points usually differ by, so that clean normals
// stay as they are, but never so wide that those on either side of a right angle mix (their chord
// is 1.41).
constexpr int kChordNeighbours = 16;
constexpr int kEvenedNeighbours = 32;
constexpr int kEveningRounds = 3;
constexpr double kEveningWidth = 4.0;
constexpr double kLargestEveningWidth = 0.8;

double MedianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

absl::Status EvenOutNormals(const std::vector<Vec3d>& points, const PointTree& tree,
                            RunContext& run, std::vector<Vec3d>& normals) {
  if (points.empty()) return absl::OkStatus();
  std::vector<double> chords(points.size());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    if (run.ShouldStop()) return;
    std::vector<PointTree::Neighbour> near;
    tree.Nearest(points[i], kChordNeighbours, near);
    chords[i] = Norm(normals[i] - normals[static_cast<size_t>(near.back().index)]);
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  const double width = std::min(kEveningWidth * MedianOf(std::move(chords)), kLargestEveningWidth);
  if (!(width > 0)) return absl::OkStatus();
  for (int round = 0; round < kEveningRounds; ++round) {
    const std::vector<Vec3d> before = normals;
    tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
      if (run.ShouldStop()) return;
      std::vector<PointTree::Neighbour> near;
      tree.Nearest(points[i], kEvenedNeighbours, near);
      const double reach = near.back().squared_distance;
      Vec3d sum = before[i];
      for (const PointTree::Neighbour& n : near) {
        const Vec3d& other = before[static_cast<size_t>(n.index)];
        if (n.index == static_cast<int32_t>(i) || !(reach > 0)) continue;
        const double fall = 1 - n.squared_distance / reach;
        const double turn = Norm(before[i] - other) / width;
        sum += other * (fall * fall * std::exp(-turn * turn));
      }
      normals[i] = Normalized(sum);
    });
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
  }
  return absl::OkStatus();
}

}  // namespace amhex
