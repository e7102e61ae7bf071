#include "relax/split_sites.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace amhex {
namespace {

// The two new sites end up half a cell apart.
constexpr double kSplitShift = 0.25;

}  // namespace

Vec3d PrincipalDirection(const CellMoments& m) {
  const auto n = static_cast<double>(m.count);
  const Eigen::Vector3d mean(static_cast<double>(m.x) / n, static_cast<double>(m.y) / n,
                             static_cast<double>(m.z) / n);
  Eigen::Matrix3d products;
  products << static_cast<double>(m.xx), static_cast<double>(m.xy), static_cast<double>(m.zx),
      static_cast<double>(m.xy), static_cast<double>(m.yy), static_cast<double>(m.yz),
      static_cast<double>(m.zx), static_cast<double>(m.yz), static_cast<double>(m.zz);
  const Eigen::Matrix3d covariance = products / n - mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  Eigen::Vector3d direction = solver.eigenvectors().col(2);
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction(largest) < 0) direction = -direction;
  return {direction(0), direction(1), direction(2)};
}

int64_t SplitClusters(const std::vector<int32_t>& claim_count,
                      const std::vector<CellMoments>& moments, int64_t site_limit,
                      RelaxationTask& task) {
  const SplitCriterion criterion{task.split_limit, task.barrier.lattice.point_volume()};
  const size_t old_count = task.position.size();
  int64_t split_count = 0;
  for (size_t site = 0; site < old_count; ++site) {
    if (static_cast<int64_t>(task.position.size()) >= site_limit) break;
    if (task.is_inside[site] == 0 ||
        !criterion(claim_count[site], moments[site].count, task.size[site])) {
      continue;
    }
    const Vec3f size = task.size[site];
    const auto mean_size = std::cbrt(static_cast<double>(size.x * size.y * size.z));
    const Vec3d shift = PrincipalDirection(moments[site]) * (kSplitShift * mean_size);
    const Vec3d centre = task.position[site];
    const BarrierView barrier = task.barrier.View();
    if (!barrier.IsInside(centre + shift) || !barrier.IsInside(centre - shift)) continue;
    task.position[site] = centre + shift;
    task.position.push_back(centre - shift);
    task.orientation.push_back(task.orientation[site]);
    task.size.push_back(size);
    task.is_inside.push_back(1);
    ++split_count;
  }
  return split_count;
}

}  // namespace amhex
