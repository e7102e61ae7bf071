#include "input/smooth_noise.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
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
constexpr size_t kProbes = 1000;
// Once moved, points have other neighbours.
constexpr int kPasses = 2;
constexpr double kSameSideCosine = 0.2;
// Planes through sixteen evened points that see one side of a wall only are flatter than this;
// those of points between two sides lie across the wall and leave them there.
constexpr double kOneSideRatio = 0.4;
// A point that has come to a side is a neighbour of that side the next time.
constexpr int kSettlingPasses = 3;

struct Plane {
  Vec3d centre;
  Vec3d lost;  // mean of what neighbours were moved by
  Vec3d normal;
  double flatness = 0;  // deviation across in that along
  double kurtosis = 0;  // of the deviations across
};

class NoiseSmoother {
 public:
  // `given`: where the points were at first.
  NoiseSmoother(const std::vector<Vec3d>& points, const std::vector<Vec3d>& given,
                const std::vector<Vec3d>& normals)
      : points_(points), given_(given), normals_(normals), tree_(points) {}

  // Itself first.
  std::vector<PointTree::Neighbour> OnTheSameSide(size_t i, int neighbours) const {
    std::vector<PointTree::Neighbour> found;
    tree_.Nearest(points_[i], neighbours, found);
    std::erase_if(found, [&](const PointTree::Neighbour& n) {
      const Vec3d& other = normals_[static_cast<size_t>(n.index)];
      return Dot(normals_[i], other) < kSameSideCosine * Norm(normals_[i]) * Norm(other);
    });
    return found;
  }

  // Over the neighbours on the same side, the nearer the more.
  Plane PlaneAt(size_t i, int neighbours) const {
    const std::vector<PointTree::Neighbour> found = OnTheSameSide(i, neighbours);
    const double reach = found.back().squared_distance;
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

 private:
  const std::vector<Vec3d>& points_;
  const std::vector<Vec3d>& given_;
  const std::vector<Vec3d>& normals_;
  const PointTree tree_;
};

double MedianOf(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// 0 if nothing is to be done.
int NeighboursNeeded(const NoiseSmoother& smoother, size_t count, const RunContext& run) {
  const size_t step = (count + kProbes - 1) / kProbes;
  int hardly_flat = 0;
  for (int neighbours = kFewestNeighbours; neighbours <= kMostNeighbours; neighbours *= 2) {
    if (kPointsPerNeighbour * static_cast<size_t>(neighbours) > count) break;
    std::vector<double> flatness((count + step - 1) / step), kurtosis(flatness.size());
    tbb::parallel_for(size_t{0}, flatness.size(), [&](size_t probe) {
      if (run.ShouldStop()) return;
      const Plane plane = smoother.PlaneAt(probe * step, neighbours);
      flatness[probe] = plane.flatness, kurtosis[probe] = plane.kurtosis;
    });
    const double ratio = MedianOf(flatness);
    if (ratio > kHardlyFlatRatio) continue;
    const bool is_noise = neighbours > kFewestNeighbours && MedianOf(kurtosis) >= kLeastKurtosis;
    if (ratio <= kFlatRatio) return is_noise ? neighbours : 0;
    if (is_noise && hardly_flat == 0) hardly_flat = neighbours;
  }
  return hardly_flat;
}

// Moves points that still lie between the sides of a wall to the flattest plane around.
absl::Status SettleBetweenSides(const std::vector<Vec3d>& normals, RunContext& run,
                                std::vector<Vec3d>& points) {
  const std::vector<Vec3d> before = points;
  const NoiseSmoother smoother(before, before, normals);
  std::vector<Plane> planes(points.size());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    if (run.ShouldStop()) return;
    planes[i] = smoother.PlaneAt(i, kFewestNeighbours);
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    if (planes[i].flatness <= kOneSideRatio || run.ShouldStop()) return;
    const Plane* flattest = &planes[i];
    for (const auto& n : smoother.OnTheSameSide(i, kFewestNeighbours)) {
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
  int neighbours = 0;
  // Planes cut corners, convex ones inside: the last pass gives back what all neighbours lost
  // alike.
  for (int pass = 0; pass <= kPasses; ++pass) {
    const std::vector<Vec3d> before = points;
    const NoiseSmoother smoother(before, given, normals);
    if (pass == 0) neighbours = NeighboursNeeded(smoother, points.size(), run);
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
    if (neighbours == 0) return 0;
    tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
      if (run.ShouldStop()) return;
      const Plane plane = smoother.PlaneAt(i, neighbours);
      const Vec3d by = pass < kPasses ? plane.centre - points[i] : plane.lost;
      points[i] += plane.normal * Dot(by, plane.normal);
    });
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
  }
  for (int pass = 0; pass < kSettlingPasses; ++pass) {
    AMHEX_RETURN_IF_ERROR(SettleBetweenSides(normals, run, points));
  }
  return neighbours;
}

}  // namespace amhex
