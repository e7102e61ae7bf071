#include "input/smooth_noise.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/status_macros.h"
#include "input/point_tree.h"

namespace amhex {
namespace {

// Neighbours are doubled until they are flat: what is farther than so many is no neighbour.
constexpr int kFewestNeighbours = 16;
constexpr int kMostNeighbours = 512;
// Of so many points one may be a neighbour: more of them would see the solid, not its surface.
constexpr size_t kPointsPerNeighbour = 16;
// Deviation across a plane in that along its narrower axis, the near neighbours counting most.
// Clean scans have 0.1 to 0.15 among 16, those whose noise is a third of the points' distance 0.5,
// and where it is larger than the distance, 16 neighbours fill space: 0.7.
constexpr double kFlatRatio = 0.6;
// Where no number of neighbours is that flat, because parts of the solid are hardly wider than the
// noise, this is enough: on a solid with noise of 1 % of the diagonal 64 of 20,000 points have
// 0.73, 128 have 0.64 and 256 some 0.6. Points that fill space have 0.7 and more.
constexpr double kHardlyFlatRatio = 0.66;
// Fourth moment across the plane in the squared second one: normally distributed noise has 3,
// evenly spread 1.8, a wall's two sides 1, the ring around a rod 1.5.
constexpr double kLeastKurtosis = 2.1;
// Points whose neighbours are looked at to tell; their median decides.
constexpr size_t kNoiseProbes = 1000;
// Once moved, points have other neighbours.
constexpr int kPasses = 2;
// Radii from one with the most neighbours around every other point on, each with twice as many on a
// surface, up to this share of the box's diagonal. All points together may have so many neighbours,
// some ten seconds of one core for every pass.
constexpr double kRadiusStep = std::numbers::sqrt2;
constexpr double kLargestRadius = 0.125;
constexpr double kMostPairs = 2e8;
constexpr double kSameSideCosine = 0.2;
// Planes through sixteen evened points that see one side of a wall only are flatter than this;
// those of points between two sides lie across the wall and leave them there.
constexpr double kOneSideRatio = 0.4;
// A point that has come to a side is a neighbour of that side the next time.
constexpr int kSettlingPasses = 3;

// What counts as a neighbour: so many nearest ones or, where points are too uneven for that, those
// within a radius, but never fewer than kFewestNeighbours.
struct Reach {
  int neighbours = 0;  // 0: nothing is to be done; around every other point where there is a radius
  double radius = 0;   // 0: none
};

struct Plane {
  Vec3d centre;
  Vec3d lost;  // mean of what neighbours were moved by
  Vec3d normal;
  double flatness = 0;  // deviation across in that along
  double kurtosis = 0;  // of the deviations across
};

double MedianOf(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class NoiseSmoother {
 public:
  // `given`: where the points were at first.
  NoiseSmoother(const std::vector<Vec3d>& points, const std::vector<Vec3d>& given,
                const std::vector<Vec3d>& normals)
      : points_(points), given_(given), normals_(normals), tree_(points) {}

  std::vector<PointTree::Neighbour> OnTheSameSide(size_t i, const Reach& reach) const {
    std::vector<PointTree::Neighbour> found;
    if (reach.radius > 0) {
      tree_.Within(points_[i], reach.radius, found);
      if (found.size() < kFewestNeighbours) tree_.Nearest(points_[i], kFewestNeighbours, found);
    } else {
      tree_.Nearest(points_[i], reach.neighbours, found);
    }
    std::erase_if(found, [&](const PointTree::Neighbour& n) {
      const Vec3d& other = normals_[static_cast<size_t>(n.index)];
      return Dot(normals_[i], other) < kSameSideCosine * Norm(normals_[i]) * Norm(other);
    });
    return found;
  }

  // Over the neighbours on the same side, the nearer the more.
  Plane PlaneAt(size_t i, const Reach& of) const {
    const std::vector<PointTree::Neighbour> found = OnTheSameSide(i, of);
    double reach = 0;
    for (const PointTree::Neighbour& n : found) reach = std::max(reach, n.squared_distance);
    std::vector<double> weights;
    Plane plane;
    double total = 0;
    for (const PointTree::Neighbour& n : found) {
      const double fall = reach > 0 ? 1 - n.squared_distance / reach : 1;
      weights.push_back(fall * fall);
      const Vec3d& p = points_[static_cast<size_t>(n.index)];
      plane.centre += p * weights.back();
      plane.lost += (given_[static_cast<size_t>(n.index)] - p) * weights.back();
      total += weights.back();
    }
    plane.centre /= total, plane.lost /= total;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (size_t k = 0; k < found.size(); ++k) {
      const Vec3d d = points_[static_cast<size_t>(found[k].index)] - plane.centre;
      const Eigen::Vector3d e(d.x, d.y, d.z);
      covariance += weights[k] * e * e.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    const Eigen::Vector3d across = solver.eigenvectors().col(0);
    plane.normal = {across[0], across[1], across[2]};
    const Eigen::Vector3d& spread = solver.eigenvalues();
    if (spread[1] > 0) plane.flatness = std::sqrt(std::max(0.0, spread[0]) / spread[1]);
    double second = 0, fourth = 0;
    for (size_t k = 0; k < found.size(); ++k) {
      const Vec3d d = points_[static_cast<size_t>(found[k].index)] - plane.centre;
      const double square = Dot(d, plane.normal) * Dot(d, plane.normal);
      second += weights[k] * square, fourth += weights[k] * square * square;
    }
    if (second > 0) plane.kurtosis = fourth * total / (second * second);
    return plane;
  }

  // How many points are within `radius` of the i-th.
  double CountWithin(size_t i, double radius) const {
    std::vector<PointTree::Neighbour> found;
    tree_.Within(points_[i], radius, found);
    return static_cast<double>(found.size());
  }
  // How far the last of so many neighbours is.
  double ReachOf(size_t i, int neighbours) const {
    std::vector<PointTree::Neighbour> found;
    tree_.Nearest(points_[i], neighbours, found);
    return std::sqrt(found.back().squared_distance);
  }
  double Diagonal() const {
    Box3d box;
    for (const Vec3d& p : points_) box.Extend(p);
    return box.Diagonal();
  }

 private:
  const std::vector<Vec3d>& points_;
  const std::vector<Vec3d>& given_;
  const std::vector<Vec3d>& normals_;
  const PointTree tree_;
};

// Of some thousand points evenly spread over the list.
template <class Ask>
std::vector<double> AskProbes(size_t count, const RunContext& run, const Ask& ask) {
  const size_t step = (count + kNoiseProbes - 1) / kNoiseProbes;
  std::vector<double> answers((count + step - 1) / step);
  tbb::parallel_for(size_t{0}, answers.size(), [&](size_t probe) {
    if (!run.ShouldStop()) answers[probe] = ask(probe * step);
  });
  return answers;
}

struct Flatness {
  double ratio = 0;
  double kurtosis = 0;
};

// Medians.
Flatness FlatnessWithin(const Reach& reach, const NoiseSmoother& smoother, size_t count,
                        const RunContext& run) {
  const size_t step = (count + kNoiseProbes - 1) / kNoiseProbes;
  std::vector<double> kurtosis((count + step - 1) / step);
  std::vector<double> flatness = AskProbes(count, run, [&](size_t i) {
    const Plane plane = smoother.PlaneAt(i, reach);
    kurtosis[i / step] = plane.kurtosis;
    return plane.flatness;
  });
  return {MedianOf(flatness), MedianOf(kurtosis)};
}

// Where the points are densest, the most neighbours do not reach as far as noise does.
Reach RadiusNeeded(const NoiseSmoother& smoother, size_t count, const RunContext& run) {
  std::vector<double> reaches =
      AskProbes(count, run, [&](size_t i) { return smoother.ReachOf(i, kMostNeighbours); });
  const double largest = kLargestRadius * smoother.Diagonal();
  for (double radius = MedianOf(reaches); radius <= largest && !run.ShouldStop();
       radius *= kRadiusStep) {
    std::vector<double> counts =
        AskProbes(count, run, [&](size_t i) { return smoother.CountWithin(i, radius); });
    const double mean =
        std::accumulate(counts.begin(), counts.end(), 0.0) / static_cast<double>(counts.size());
    if (mean * static_cast<double>(count) > kMostPairs) return {};
    const Flatness flat = FlatnessWithin({kMostNeighbours, radius}, smoother, count, run);
    if (flat.ratio > kHardlyFlatRatio) continue;
    if (flat.kurtosis < kLeastKurtosis) return {};
    return {static_cast<int>(MedianOf(counts)), radius};
  }
  return {};
}

Reach ReachNeeded(const NoiseSmoother& smoother, size_t count, const RunContext& run) {
  int hardly_flat = 0, asked = 0;
  bool is_layered = false;
  for (int neighbours = kFewestNeighbours; neighbours <= kMostNeighbours; neighbours *= 2) {
    if (kPointsPerNeighbour * static_cast<size_t>(neighbours) > count) break;
    asked = neighbours;
    const Flatness flat = FlatnessWithin({neighbours, 0}, smoother, count, run);
    if (flat.ratio > kHardlyFlatRatio) continue;
    const bool is_noise = neighbours > kFewestNeighbours && flat.kurtosis >= kLeastKurtosis;
    if (flat.ratio <= kFlatRatio) return {is_noise ? neighbours : 0, 0};
    is_layered = is_layered || !is_noise;
    if (is_noise && hardly_flat == 0) hardly_flat = neighbours;
  }
  const bool fewer_do = hardly_flat > 0 && hardly_flat < kMostNeighbours;
  if (asked == kMostNeighbours && !fewer_do && !is_layered) {
    const Reach wider = RadiusNeeded(smoother, count, run);
    if (wider.neighbours > 0) return wider;
  }
  return {hardly_flat, 0};
}

// Moves points that still lie between the sides of a wall to the flattest plane around.
absl::Status SettleBetweenSides(const std::vector<Vec3d>& normals, RunContext& run,
                                std::vector<Vec3d>& points) {
  const std::vector<Vec3d> before = points;
  const NoiseSmoother smoother(before, before, normals);
  std::vector<Plane> planes(points.size());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    if (run.ShouldStop()) return;
    planes[i] = smoother.PlaneAt(i, {kFewestNeighbours, 0});
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    if (planes[i].flatness <= kOneSideRatio || run.ShouldStop()) return;
    const Plane* flattest = &planes[i];
    for (const auto& n : smoother.OnTheSameSide(i, {kFewestNeighbours, 0})) {
      const Plane& plane = planes[static_cast<size_t>(n.index)];
      if (plane.flatness < flattest->flatness) flattest = &plane;
    }
    if (flattest->flatness > kOneSideRatio) return;
    points[i] += flattest->normal * Dot(flattest->centre - points[i], flattest->normal);
  });
  return run.CheckStop();
}

}  // namespace

absl::StatusOr<int> SmoothNoise(const std::vector<Vec3d>& normals, RunContext& run,
                                std::vector<Vec3d>& points) {
  if (points.size() < kFewestNeighbours) return 0;
  const std::vector<Vec3d> given = points;
  Reach reach;
  // Planes cut corners, convex ones inside: the last pass gives back what all neighbours lost
  // alike.
  for (int pass = 0; pass <= kPasses; ++pass) {
    const std::vector<Vec3d> before = points;
    const NoiseSmoother smoother(before, given, normals);
    if (pass == 0) reach = ReachNeeded(smoother, points.size(), run);
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
    if (reach.neighbours == 0) return 0;
    tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
      if (run.ShouldStop()) return;
      const Plane plane = smoother.PlaneAt(i, reach);
      const Vec3d by = pass < kPasses ? plane.centre - points[i] : plane.lost;
      points[i] += plane.normal * Dot(by, plane.normal);
    });
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
  }
  for (int pass = 0; pass < kSettlingPasses; ++pass) {
    AMHEX_RETURN_IF_ERROR(SettleBetweenSides(normals, run, points));
  }
  return reach.neighbours;
}

}  // namespace amhex
