#include "input/normal_scatter.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "base/status_macros.h"
#include "input/surface_tensor.h"

namespace amhex {
namespace {

// As many as planes are put through (input/estimate_normals). More see more of the solid's own
// shape, which fits of so low a degree leave to both.
constexpr int kScatterNeighbours = 16;
constexpr size_t kProbes = 1000;
constexpr double kSameSideCosine = 0.2;
constexpr int kLinear = 3;     // 1, x, y
constexpr int kQuadratic = 6;  // and x^2, xy, y^2
constexpr size_t kFewestFitted = 10;
// Normals that scatter by less, radians, move no surface: it is made on a grid of three to six
// nodes per edge length. Those of CAD triangles have 0.005, of scans 0.05 to 0.1.
constexpr double kLeastScatter = 0.02;

using Column = Eigen::VectorXd;

// Sum of squares that least squares over the first kTerms of each row leave of the values.
template <int kTerms>
double LeftOver(const Eigen::MatrixXd& rows, const Column& values) {
  const Eigen::MatrixXd terms = rows.leftCols<kTerms>();
  const Eigen::Matrix<double, kTerms, kTerms> squares = terms.transpose() * terms;
  const Eigen::Matrix<double, kTerms, 1> right_side = terms.transpose() * values;
  const Eigen::Matrix<double, kTerms, 1> fit = squares.ldlt().solve(right_side);
  return (values - terms * fit).squaredNorm() / static_cast<double>(rows.rows() - kTerms);
}

// Around one point; false as well where too few neighbours look to the same side.
bool ScatterMoreAt(size_t i, const std::vector<Vec3d>& points, const std::vector<Vec3d>& normals,
                   std::vector<PointTree::Neighbour> near) {
  std::erase_if(near, [&](const PointTree::Neighbour& n) {
    return Dot(normals[i], normals[static_cast<size_t>(n.index)]) < kSameSideCosine;
  });
  if (near.size() < kFewestFitted) return false;
  Vec3d mean;
  for (const auto& n : near) mean += normals[static_cast<size_t>(n.index)];
  mean = Normalized(mean);
  const Vec3d u = AnyTangent(mean), v = Cross(mean, u);
  const auto count = static_cast<double>(near.size());
  const double spacing = std::sqrt(std::numbers::pi * near.back().squared_distance / count);
  if (!(spacing > 0)) return false;
  const auto row_count = static_cast<Eigen::Index>(near.size());
  Eigen::MatrixXd rows(row_count, kQuadratic);
  Column height(row_count), along_u(row_count), along_v(row_count);
  for (Eigen::Index k = 0; k < row_count; ++k) {
    const auto at = static_cast<size_t>(near[static_cast<size_t>(k)].index);
    const Vec3d d = (points[at] - points[i]) / spacing;
    const double x = Dot(d, u), y = Dot(d, v);
    rows.row(k) << 1, x, y, x * x, x * y, y * y;
    height[k] = Dot(d, mean);
    along_u[k] = Dot(normals[at], u), along_v[k] = Dot(normals[at], v);
  }
  const double of_normals =
      (LeftOver<kLinear>(rows, along_u) + LeftOver<kLinear>(rows, along_v)) / 2;
  return of_normals > kLeastScatter * kLeastScatter &&
         of_normals > LeftOver<kQuadratic>(rows, height);
}

}  // namespace

absl::StatusOr<bool> NormalsScatterMore(const std::vector<Vec3d>& points,
                                        const std::vector<Vec3d>& normals, const PointTree& tree,
                                        RunContext& run) {
  if (points.empty()) return false;
  const size_t step = (points.size() + kProbes - 1) / kProbes;
  std::vector<uint8_t> is_more((points.size() + step - 1) / step, 0);
  tbb::parallel_for(size_t{0}, is_more.size(), [&](size_t probe) {
    if (run.ShouldStop()) return;
    std::vector<PointTree::Neighbour> near;
    tree.Nearest(points[probe * step], kScatterNeighbours, near);
    is_more[probe] = ScatterMoreAt(probe * step, points, normals, std::move(near)) ? 1 : 0;
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  const auto count = std::count(is_more.begin(), is_more.end(), uint8_t{1});
  return 2 * static_cast<size_t>(count) > is_more.size();
}

}  // namespace amhex
