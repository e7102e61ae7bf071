#include "distance/triangle_tree.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

namespace amhex::client {
namespace {

constexpr int32_t kLeafTriangles = 8;

double SquaredDistanceToSegment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d along = b - a;
  const double length = SquaredNorm(along);
  const double place = length > 0 ? std::clamp(Dot(p - a, along) / length, 0.0, 1.0) : 0.0;
  return SquaredNorm(p - (a + along * place));
}

double SquaredDistanceToBox(const Vec3d& p, const Box3d& box) {
  return SquaredNorm(ComponentMax(ComponentMax(box.low - p, p - box.high), Vec3d{0.0, 0.0, 0.0}));
}

}  // namespace

double SquaredDistanceToTriangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d normal = Cross(b - a, c - a);
  const double area = SquaredNorm(normal);
  // Over the inside of the triangle its plane decides, elsewhere its border does.
  if (area > 0 && Dot(Cross(b - a, p - a), normal) >= 0 && Dot(Cross(c - b, p - b), normal) >= 0 &&
      Dot(Cross(a - c, p - c), normal) >= 0) {
    const double height = Dot(p - a, normal);
    return height * height / area;
  }
  return std::min({SquaredDistanceToSegment(p, a, b), SquaredDistanceToSegment(p, b, c),
                   SquaredDistanceToSegment(p, c, a)});
}

TriangleTree::TriangleTree(TriangleMesh mesh)
    : mesh_(std::move(mesh)), order_(mesh_.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<Vec3d> centres;
  centres.reserve(order_.size());
  for (const auto& [a, b, c] : mesh_.triangles) {
    centres.push_back((mesh_.vertices[a] + mesh_.vertices[b] + mesh_.vertices[c]) / 3.0);
  }
  nodes_.push_back({{}, 0, static_cast<int32_t>(order_.size())});
  // Nodes are appended while this runs; halving keeps their number below that of the triangles.
  for (size_t node = 0; node < nodes_.size(); ++node) Split(static_cast<int32_t>(node), centres);
}

void TriangleTree::Split(int32_t node, const std::vector<Vec3d>& centres) {
  const int32_t first = nodes_[node].first, count = nodes_[node].count;
  Box3d box, box_of_centres;
  for (int32_t i = first; i < first + count; ++i) {
    for (int32_t vertex : mesh_.triangles[order_[i]]) box.Extend(mesh_.vertices[vertex]);
    box_of_centres.Extend(centres[order_[i]]);
  }
  nodes_[node].box = box;
  if (count <= kLeafTriangles) return;
  const Vec3d extent = box_of_centres.Extent();
  int axis = extent.x >= extent.y ? 0 : 1;
  if (extent.z > extent[axis]) axis = 2;
  const int32_t half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](int32_t a, int32_t b) {
    return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis] : a < b;
  });
  nodes_[node].first = static_cast<int32_t>(nodes_.size());
  nodes_[node].count = 0;
  nodes_.push_back({{}, first, half});
  nodes_.push_back({{}, first + half, count - half});
}

void TriangleTree::FindInLeaf(const Node& leaf, const Vec3d& point, double* least,
                              int32_t* triangle) const {
  for (int32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
    const auto& [a, b, c] = mesh_.triangles[order_[i]];
    const double squared =
        SquaredDistanceToTriangle(point, mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]);
    if (squared < *least) *least = squared, *triangle = order_[i];
  }
}

TriangleTree::Closest TriangleTree::Find(const Vec3d& point) const {
  // As deep as halving 2^31 triangles goes, one node waiting at each level.
  constexpr size_t kMostWaiting = 64;
  struct Waiting {
    int32_t node;
    double squared;
  };
  std::array<Waiting, kMostWaiting> waiting;
  size_t count = 0;
  double least = std::numeric_limits<double>::infinity();
  int32_t triangle = -1;
  waiting[count++] = {0, 0.0};
  while (count > 0) {
    const Waiting next = waiting[--count];
    if (next.squared >= least) continue;
    const Node& node = nodes_[next.node];
    if (node.count > 0) {
      FindInLeaf(node, point, &least, &triangle);
      continue;
    }
    Waiting near{node.first, SquaredDistanceToBox(point, nodes_[node.first].box)};
    Waiting far{node.first + 1, SquaredDistanceToBox(point, nodes_[node.first + 1].box)};
    if (far.squared < near.squared) std::swap(near, far);
    waiting[count++] = far;
    waiting[count++] = near;
  }
  return {std::sqrt(least), triangle};
}

}  // namespace amhex::client
