#include "input/estimate_normals.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <tuple>

#include "base/status_macros.h"
#include "input/even_normals.h"
#include "input/point_tree.h"

namespace amhex {
namespace {

constexpr size_t kPlaneNeighbours = 16;
// A plane through more than this share of all points sees the solid, not its surface.
constexpr size_t kPlanesPerCloud = 2;
constexpr size_t kFewestPlaneNeighbours = 4;

Vec3d PlaneNormal(const std::vector<Vec3d>& points,
                  const std::vector<PointTree::Neighbour>& neighbours) {
  Vec3d mean;
  for (const auto& n : neighbours) mean += points[static_cast<size_t>(n.index)];
  mean /= static_cast<double>(neighbours.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& n : neighbours) {
    const Vec3d d = points[static_cast<size_t>(n.index)] - mean;
    const Eigen::Vector3d e(d.x, d.y, d.z);
    covariance += e * e.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  return {normal[0], normal[1], normal[2]};
}

// Prim's algorithm over the neighbour graph, part by part; an edge costs more the less its ends
// seem to lie on one sheet, and tells its far end which way to look.
class NormalOrienter {
 public:
  NormalOrienter(const std::vector<Vec3d>& points, const std::vector<std::vector<int32_t>>& graph,
                 std::vector<Vec3d>& normals)
      : points_(points), graph_(graph), normals_(normals), done_(points.size(), 0) {}

  absl::Status OrientAll(RunContext& run) {
    // Highest points first: the first of each part lies on its outside and looks up, as a rule.
    std::vector<int32_t> order(points_.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
      const double za = points_[static_cast<size_t>(a)].z, zb = points_[static_cast<size_t>(b)].z;
      return za != zb ? za > zb : a < b;
    });
    for (const int32_t seed : order) {
      if (done_[static_cast<size_t>(seed)] != 0) continue;
      AMHEX_RETURN_IF_ERROR(run.CheckStop());
      Vec3d& normal = normals_[static_cast<size_t>(seed)];
      if (normal.z < 0) normal = -normal;
      const std::vector<int32_t> part = OrientFrom(seed);
      if (OutwardVote(points_, normals_, part) >= 0) continue;
      for (const int32_t i : part)
        normals_[static_cast<size_t>(i)] = -normals_[static_cast<size_t>(i)];
    }
    return absl::OkStatus();
  }

 private:
  // The points of the seed's part.
  std::vector<int32_t> OrientFrom(int32_t seed) {
    std::vector<int32_t> part;
    using Entry = std::tuple<double, int32_t, int32_t>;  // cost, from, to
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    const auto settle = [&](int32_t at) {
      done_[static_cast<size_t>(at)] = 1;
      part.push_back(at);
      for (const int32_t to : graph_[static_cast<size_t>(at)]) {
        if (done_[static_cast<size_t>(to)] != 0) continue;
        queue.emplace(1 - Trust(static_cast<size_t>(at), static_cast<size_t>(to)), at, to);
      }
    };
    settle(seed);
    while (!queue.empty()) {
      const auto [cost, from, to] = queue.top();
      queue.pop();
      if (done_[static_cast<size_t>(to)] != 0) continue;
      Vec3d& normal = normals_[static_cast<size_t>(to)];
      if (Dot(normal, normals_[static_cast<size_t>(from)]) < 0) normal = -normal;
      settle(to);
    }
    return part;
  }

  // [0, 1] that two neighbours lie on one sheet: their planes agree, and each lies in the other's.
  // (Two sides of a thin part, or strands that pass each other, have parallel planes too, but lie
  // above one another.)
  double Trust(size_t a, size_t b) const {
    const Vec3d along = Normalized(points_[b] - points_[a]);
    const double above =
        std::max(std::abs(Dot(normals_[a], along)), std::abs(Dot(normals_[b], along)));
    return std::abs(Dot(normals_[a], normals_[b])) * (1 - above);
  }

  const std::vector<Vec3d>& points_;
  const std::vector<std::vector<int32_t>>& graph_;
  std::vector<Vec3d>& normals_;
  std::vector<uint8_t> done_;
};

}  // namespace

double OutwardVote(const std::vector<Vec3d>& points, const std::vector<Vec3d>& normals,
                   const std::vector<int32_t>& part) {
  double vote = 0;
  for (int k = 0; k < 27; ++k) {
    if (k == 13) continue;
    const int x = k % 3, y = k / 3 % 3, z = k / 9;
    const Vec3d out = Normalized(Vec3d{x - 1.0, y - 1.0, z - 1.0});
    const auto along = [&](int32_t i) { return Dot(points[static_cast<size_t>(i)], out); };
    const int32_t farthest = *std::max_element(
        part.begin(), part.end(), [&](int32_t a, int32_t b) { return along(a) < along(b); });
    vote += Dot(normals[static_cast<size_t>(farthest)], out);
  }
  return vote;
}

absl::StatusOr<std::vector<Vec3d>> EstimateNormals(const std::vector<Vec3d>& points,
                                                   RunContext& run) {
  const PointTree tree(points);
  std::vector<Vec3d> normals(points.size());
  std::vector<std::vector<int32_t>> graph(points.size());
  const auto wanted = static_cast<int>(
      std::clamp(points.size() / kPlanesPerCloud, kFewestPlaneNeighbours, kPlaneNeighbours));
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    if (run.ShouldStop()) return;
    std::vector<PointTree::Neighbour> neighbours;
    tree.Nearest(points[i], wanted, neighbours);
    normals[i] = PlaneNormal(points, neighbours);
    const size_t linked = std::min<size_t>(neighbours.size(), kLinkedNeighbours + 1);
    for (size_t k = 0; k < linked; ++k) {
      if (neighbours[k].index != static_cast<int32_t>(i)) graph[i].push_back(neighbours[k].index);
    }
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  // Links count both ways.
  const std::vector<std::vector<int32_t>> one_way = graph;
  for (size_t i = 0; i < one_way.size(); ++i) {
    for (const int32_t j : one_way[i])
      graph[static_cast<size_t>(j)].push_back(static_cast<int32_t>(i));
  }
  NormalOrienter orienter(points, graph, normals);
  AMHEX_RETURN_IF_ERROR(orienter.OrientAll(run));
  AMHEX_RETURN_IF_ERROR(EvenOutNormals(points, tree, run, normals));
  return normals;
}

}  // namespace amhex
