#include "input/curvature.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "input/surface_topology.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

// Some milliseconds of work.
constexpr size_t kTrianglesPerBlock = 4096;

// The hull with one vertex per smooth fan: cut open along its sharp edges.
TriangleMesh CutAlongSharpEdges(const Hull& hull, const StopPoll& poll) {
  TriangleMesh cut{hull.vertices, hull.triangles};
  EdgeAdjacency adjacency = FindEdgeAdjacency(cut, poll);
  std::vector<std::pair<int32_t, int32_t>> walls;
  for (const SharpEdge& edge : hull.sharp_edges) {
    walls.emplace_back(std::minmax(edge.vertex_a, edge.vertex_b));
  }
  std::sort(walls.begin(), walls.end());
  for (size_t e = 0; e < adjacency.opposite.size(); ++e) {
    poll.At(static_cast<int64_t>(e));
    const auto& t = hull.triangles[e / 3];
    const std::pair<int32_t, int32_t> edge = std::minmax(t[e % 3], t[(e + 1) % 3]);
    if (std::binary_search(walls.begin(), walls.end(), edge)) adjacency.opposite[e] = kOpenEdge;
  }
  SplitFans(adjacency, cut, poll);
  return cut;
}

double AngleAt(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d u = b - a, v = c - a;
  return std::atan2(Norm(Cross(u, v)), Dot(u, v));
}

std::vector<Vec3d> VertexNormals(const TriangleMesh& mesh, const std::vector<Vec3d>& normals,
                                 const StopPoll& poll) {
  std::vector<Vec3d> sums(mesh.vertices.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    poll.At(static_cast<int64_t>(t));
    const auto& corners = mesh.triangles[t];
    for (size_t i = 0; i < 3; ++i) {
      const auto a = static_cast<size_t>(corners[i]);
      const auto b = static_cast<size_t>(corners[(i + 1) % 3]);
      const auto c = static_cast<size_t>(corners[(i + 2) % 3]);
      sums[a] += normals[t] * AngleAt(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    }
  }
  for (Vec3d& n : sums) n = Normalized(n);
  return sums;
}

// Least squares of  II (e.u, e.v) = (dn.u, dn.v)  over the three edges e, dn the change of the
// normal along the edge.
SymmetricTensor TriangleTensor(const std::array<Vec3d, 3>& corner,
                               const std::array<Vec3d, 3>& normal, const Vec3d& face_normal) {
  const Vec3d u = Normalized(corner[1] - corner[0]);
  const Vec3d v = Cross(face_normal, u);
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3;
    const Vec3d edge = corner[j] - corner[i], turn = normal[j] - normal[i];
    const double eu = Dot(edge, u), ev = Dot(edge, v);
    const Eigen::Vector3d row_u(eu, ev, 0), row_v(0, eu, ev);
    normal_matrix += row_u * row_u.transpose() + row_v * row_v.transpose();
    right_side += row_u * Dot(turn, u) + row_v * Dot(turn, v);
  }
  const Eigen::Vector3d ii = normal_matrix.ldlt().solve(right_side);
  SymmetricTensor tensor;
  if (!ii.allFinite()) return tensor;
  const double a = ii[0], b = ii[1], c = ii[2];
  const auto entry = [&](int i, int j) {
    return a * u[i] * u[j] + b * (u[i] * v[j] + v[i] * u[j]) + c * v[i] * v[j];
  };
  tensor = {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(2, 0)};
  return tensor;
}

}  // namespace

std::vector<SymmetricTensor> TriangleCurvatures(const Hull& hull, const StopPoll& poll) {
  const TriangleMesh cut = CutAlongSharpEdges(hull, poll);
  const std::vector<Vec3d> normals = VertexNormals(cut, hull.triangle_normals, poll);
  std::vector<SymmetricTensor> tensors(cut.triangles.size());
  const auto compute = [&](size_t t) {
    std::array<Vec3d, 3> corner, normal;
    for (size_t i = 0; i < 3; ++i) {
      const auto v = static_cast<size_t>(cut.triangles[t][i]);
      corner[i] = cut.vertices[v], normal[i] = normals[v];
    }
    if (IsDegenerate(corner[0], corner[1], corner[2])) return;
    tensors[t] = TriangleTensor(corner, normal, hull.triangle_normals[t]);
  };
  tbb::parallel_for(tbb::blocked_range<size_t>(0, tensors.size(), kTrianglesPerBlock),
                    [&](const tbb::blocked_range<size_t>& range) {
                      for (size_t t = range.begin(); t < range.end(); ++t) {
                        poll.At(static_cast<int64_t>(t));
                        compute(t);
                      }
                    });
  return tensors;
}

}  // namespace amhex
