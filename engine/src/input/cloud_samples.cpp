#include "input/cloud_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/sort_polling.h"
#include "base/status_macros.h"
#include "input/curvature.h"
#include "input/estimate_normals.h"
#include "input/even_normals.h"
#include "input/hollow_parts.h"
#include "input/normal_scatter.h"
#include "input/point_tree.h"
#include "input/smooth_noise.h"
#include "input/warn_of.h"

namespace amhex {
namespace {

// Neighbours that the area is measured by, and how many are looked at to find them: around edges
// and in thin parts half of those near look elsewhere.
constexpr size_t kAreaNeighbours = 12;
constexpr int kSearchedNeighbours = 32;
// A point this much farther from its neighbours than those from theirs is none of the surface.
constexpr double kOutlierRatio = 6.0;
constexpr char kOutliersLeftOut[] =
    "outliers, much farther from their neighbours than those from theirs, left out";
constexpr double kSameSideCosine = 0.2;
// Normals of equal points that add up to less than this share of their lengths point nowhere.
constexpr double kCancelledRatio = 1e-12;
// Squares of lengths above it are normal numbers. Lengths mean nothing: they may be areas of
// triangles, of a scan in metres of a part that is microns large.
constexpr double kShortestNormal = 1e-100;
// Of the 26 directions of OutwardVote: if more than half look in, all normals do. A box turned
// inside out has -19, without its bottom -18, one side of a sheet about 0.
constexpr double kInsideOutVote = -13;

// Equal points in a row after sorting: keeps the first of each and adds the others' normals.
int64_t JoinEqualPoints(CloudSamples& samples, const StopPoll& poll) {
  std::vector<std::pair<std::array<double, 3>, int32_t>> keys;
  for (size_t i = 0; i < samples.position.size(); ++i) {
    const Vec3d& p = samples.position[i];
    keys.push_back({{p.x, p.y, p.z}, static_cast<int32_t>(i)});
  }
  ParallelSortPolling(keys.begin(), keys.end(), poll);
  std::vector<uint8_t> keep(keys.size(), 1);
  std::vector<double> length(samples.normal.size());
  for (size_t i = 0; i < length.size(); ++i) length[i] = Norm(samples.normal[i]);
  int64_t joined = 0;
  for (size_t i = 1, first = 0; i < keys.size(); ++i) {
    if (keys[i].first != keys[first].first) {
      first = i;
      continue;
    }
    const auto into = static_cast<size_t>(keys[first].second);
    const auto from = static_cast<size_t>(keys[i].second);
    samples.normal[into] += samples.normal[from];
    length[into] += length[from];
    keep[from] = 0;
    ++joined;
  }
  size_t kept = 0;
  for (size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    samples.position[kept] = samples.position[i];
    const bool is_cancelled = Norm(samples.normal[i]) <= kCancelledRatio * length[i];
    samples.normal[kept++] = is_cancelled ? Vec3d{} : samples.normal[i];
  }
  samples.position.resize(kept), samples.normal.resize(kept);
  return joined;
}

// Brings normals to unit length and drops samples without one.
int64_t NormalizeDirections(CloudSamples& samples) {
  size_t kept = 0;
  for (size_t i = 0; i < samples.position.size(); ++i) {
    const double length = Norm(samples.normal[i]);
    if (!(length > kShortestNormal)) continue;
    samples.position[kept] = samples.position[i];
    samples.normal[kept++] = samples.normal[i] / length;
  }
  const auto dropped = static_cast<int64_t>(samples.position.size() - kept);
  samples.position.resize(kept), samples.normal.resize(kept);
  return dropped;
}

bool HasDirections(const PointCloud& cloud) {
  return std::any_of(cloud.normals.begin(), cloud.normals.end(),
                     [](const Vec3d& n) { return Norm(n) > kShortestNormal; });
}

// Scanners and converters that write normals into the solid do so everywhere.
void TurnOutward(CloudSamples& samples, std::vector<std::string>& warnings) {
  if (samples.position.empty()) return;
  std::vector<int32_t> all(samples.position.size());
  std::iota(all.begin(), all.end(), 0);
  if (OutwardVote(samples.position, samples.normal, all) >= kInsideOutVote) return;
  for (Vec3d& n : samples.normal) n = -n;
  warnings.push_back("the cloud's normals look into it, all turned");
}

struct Neighbourhood {
  double spacing = 0;         // from this sample's own neighbours
  double distance = 0;        // to the 8th neighbour of any direction
  std::vector<int32_t> near;  // the nearest eight, itself included
};

std::vector<Neighbourhood> MeasureNeighbourhoods(const CloudSamples& samples, RunContext& run) {
  const PointTree tree(samples.position);
  std::vector<Neighbourhood> result(samples.position.size());
  tbb::parallel_for(size_t{0}, result.size(), [&](size_t i) {
    if (run.ShouldStop()) return;
    std::vector<PointTree::Neighbour> found;
    tree.Nearest(samples.position[i], kSearchedNeighbours, found);
    Neighbourhood& hood = result[i];
    for (size_t k = 0; k < std::min<size_t>(found.size(), 9); ++k) {
      hood.near.push_back(found[k].index);
      hood.distance = std::sqrt(found[k].squared_distance);
    }
    // With m neighbours within r, itself not counted, the density is about (m - 1/2) / (pi r^2).
    size_t count = 0;
    double squared = 0;
    for (const auto& n : found) {
      if (n.index == static_cast<int32_t>(i)) continue;
      if (Dot(samples.normal[i], samples.normal[static_cast<size_t>(n.index)]) < kSameSideCosine) {
        continue;
      }
      squared = n.squared_distance;
      if (++count == kAreaNeighbours) break;
    }
    if (count == 0) {
      count = std::max<size_t>(found.size(), 2) - 1;
      squared = found.empty() ? 0 : found.back().squared_distance;
    }
    hood.spacing = std::sqrt(std::numbers::pi * squared / (static_cast<double>(count) - 0.5));
  });
  return result;
}

double MedianOf(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Drops outliers and fills in the spacing.
int64_t SettleSpacing(const std::vector<Neighbourhood>& hoods, CloudSamples& samples) {
  std::vector<double> spacing(hoods.size());
  std::vector<uint8_t> keep(hoods.size(), 1);
  for (size_t i = 0; i < hoods.size(); ++i) {
    std::vector<double> spacings, distances;
    for (const int32_t j : hoods[i].near) {
      spacings.push_back(hoods[static_cast<size_t>(j)].spacing);
      if (j != static_cast<int32_t>(i)) {
        distances.push_back(hoods[static_cast<size_t>(j)].distance);
      }
    }
    spacing[i] = MedianOf(spacings);
    if (!distances.empty() && hoods[i].distance > kOutlierRatio * MedianOf(distances)) keep[i] = 0;
  }
  size_t kept = 0;
  for (size_t i = 0; i < hoods.size(); ++i) {
    if (keep[i] == 0) continue;
    samples.position[kept] = samples.position[i];
    samples.normal[kept] = samples.normal[i];
    spacing[kept++] = spacing[i];
  }
  spacing.resize(kept);
  samples.position.resize(kept), samples.normal.resize(kept);
  samples.spacing = std::move(spacing);
  return static_cast<int64_t>(hoods.size() - kept);
}

// As SettleSpacing does, but among more neighbours: of the nearest few most may be outliers too.
int64_t LeaveOutliersOut(CloudSamples& samples, const RunContext& run) {
  const PointTree tree(samples.position);
  std::vector<std::vector<PointTree::Neighbour>> near(samples.position.size());
  std::vector<double> distance(near.size());
  tbb::parallel_for(size_t{0}, near.size(), [&](size_t i) {
    if (run.ShouldStop()) return;
    tree.Nearest(samples.position[i], kSearchedNeighbours, near[i]);
    const size_t eighth = std::min<size_t>(near[i].size() - 1, 8);
    distance[i] = std::sqrt(near[i][eighth].squared_distance);
  });
  if (run.ShouldStop()) return 0;
  size_t kept = 0;
  for (size_t i = 0; i < near.size(); ++i) {
    std::vector<double> others;
    for (const auto& n : near[i]) others.push_back(distance[static_cast<size_t>(n.index)]);
    if (distance[i] > kOutlierRatio * MedianOf(others)) continue;
    samples.position[kept] = samples.position[i];
    samples.normal[kept++] = samples.normal[i];
  }
  samples.position.resize(kept), samples.normal.resize(kept);
  return static_cast<int64_t>(near.size() - kept);
}

// Outliers are left out first: planes would draw them to the surface or to each other, where
// nothing tells them any more.
absl::Status EvenOutNoise(RunContext& run, CloudSamples& samples,
                          std::vector<std::string>& warnings) {
  CloudSamples even = samples;
  const int64_t outliers = LeaveOutliersOut(even, run);
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  AMHEX_ASSIGN_OR_RETURN(const int neighbours, SmoothNoise(even.normal, run, even.position));
  if (neighbours == 0) return absl::OkStatus();
  samples = std::move(even);
  WarnOf(outliers, kOutliersLeftOut, warnings);
  WarnOf(neighbours, "noise larger than the distance of the points, evened out over neighbours",
         warnings);
  return absl::OkStatus();
}

absl::Status EvenOutGivenNormals(RunContext& run, CloudSamples& samples) {
  const PointTree tree(samples.position);
  AMHEX_ASSIGN_OR_RETURN(const bool are_rough,
                         NormalsScatterMore(samples.position, samples.normal, tree, run));
  if (!are_rough) return absl::OkStatus();
  return EvenOutNormals(samples.position, tree, run, samples.normal);
}

}  // namespace

absl::StatusOr<CloudSamples> PrepareCloud(const PointCloud& cloud, RunContext& run,
                                          std::vector<std::string>& warnings) {
  CloudSamples samples{cloud.points, cloud.normals, {}};
  const bool has_normals = HasDirections(cloud);
  if (!has_normals) {
    samples.normal.assign(samples.position.size(), Vec3d{});
    WarnOf(JoinEqualPoints(samples, StopPoll(run)), "points at the same place, joined", warnings);
    AMHEX_RETURN_IF_ERROR(EvenOutNoise(run, samples, warnings));
    AMHEX_ASSIGN_OR_RETURN(samples.normal, EstimateNormals(samples.position, run));
    warnings.push_back("the cloud has no normals, estimated by the engine");
  } else {
    WarnOf(JoinEqualPoints(samples, StopPoll(run)), "points at the same place, joined", warnings);
    WarnOf(NormalizeDirections(samples), "points without a direction, left out", warnings);
    AMHEX_RETURN_IF_ERROR(EvenOutNoise(run, samples, warnings));
    TurnOutward(samples, warnings);
    AMHEX_RETURN_IF_ERROR(EvenOutGivenNormals(run, samples));
  }
  if (samples.position.size() < 4) {
    return absl::InvalidArgumentError(
        absl::StrCat("the cloud has ", samples.position.size(),
                     " usable points: at least 4 that span space are needed"));
  }
  const std::vector<Neighbourhood> hoods = MeasureNeighbourhoods(samples, run);
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  WarnOf(SettleSpacing(hoods, samples), kOutliersLeftOut, warnings);
  if (!has_normals) {
    AMHEX_RETURN_IF_ERROR(TurnInsideOutSamples(run, samples).status());
    AMHEX_ASSIGN_OR_RETURN(const int64_t turned, HollowNestedParts(run, samples));
    WarnOf(turned,
           "closed parts of the cloud within others, taken for cavities without normals to tell",
           warnings);
  }
  return samples;
}

TriangleMesh DiscSoup(const CloudSamples& samples) {
  // An equilateral triangle of area A has the circumradius sqrt(4 A / (3 sqrt 3)).
  const double radius_per_spacing = std::sqrt(4 / (3 * std::numbers::sqrt3));
  TriangleMesh soup;
  for (size_t i = 0; i < samples.position.size(); ++i) {
    const Vec3d& n = samples.normal[i];
    const Vec3d u = AnyTangent(n), v = Cross(n, u);
    const double radius = radius_per_spacing * samples.spacing[i];
    const auto first = static_cast<int32_t>(soup.vertices.size());
    for (int k = 0; k < 3; ++k) {
      const double angle = 2 * std::numbers::pi * k / 3;
      soup.vertices.push_back(samples.position[i] +
                              (u * std::cos(angle) + v * std::sin(angle)) * radius);
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

}  // namespace amhex
