#include "closure/ridges.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <utility>

#include "input/sharp_features.h"

namespace amhex {
namespace {

constexpr double kLeastDepth = 1e-9;  // edge lengths: of rounding
// Shorter ones are noise (input/sharp_features, FollowedEdges), where stars fill better.
constexpr double kLeastLength = 3.0;

bool IsAcuteRidge(const Hull& hull, const SharpEdge& edge) {
  const Vec3d& left = hull.triangle_normals[edge.triangle_left];
  const Vec3d& right = hull.triangle_normals[edge.triangle_right];
  if (Dot(left, right) > kAcuteRidgeCosine) return false;
  // A slit is as sharp from outside: there the triangle across lies before the plane.
  const Vec3d& on_edge = hull.vertices[edge.vertex_a];
  const auto& across = hull.triangles[edge.triangle_right];
  return std::any_of(across.begin(), across.end(), [&](int32_t v) {
    return Dot(left, hull.vertices[v] - on_edge) < -kLeastDepth;
  });
}

double LengthOf(const std::vector<LineSegment>& segments) {
  double length = 0;
  for (const LineSegment& s : segments) length += Norm(s.second - s.first);
  return length;
}

}  // namespace

std::vector<SegmentQueries> AcuteRidges(const Hull& hull) {
  std::vector<SharpEdge> edges;
  for (const SharpEdge& edge : hull.sharp_edges) {
    if (IsAcuteRidge(hull, edge)) edges.push_back(edge);
  }
  std::vector<size_t> piece(edges.size());
  std::iota(piece.begin(), piece.end(), size_t{0});
  const auto find = [&](size_t e) {
    while (piece[e] != e) e = piece[e] = piece[piece[e]];
    return e;
  };
  std::map<int32_t, size_t> first_at;
  for (size_t e = 0; e < edges.size(); ++e) {
    for (const int32_t v : {edges[e].vertex_a, edges[e].vertex_b}) {
      const size_t a = find(first_at.try_emplace(v, e).first->second), b = find(e);
      piece[std::max(a, b)] = std::min(a, b);
    }
  }
  std::map<size_t, std::vector<LineSegment>> segments;
  for (size_t e = 0; e < edges.size(); ++e) {
    segments[find(e)].push_back(
        {hull.vertices[edges[e].vertex_a], hull.vertices[edges[e].vertex_b]});
  }
  std::vector<SegmentQueries> ridges;
  for (auto& [first, own] : segments) {
    if (LengthOf(own) >= kLeastLength) ridges.emplace_back(std::move(own));
  }
  return ridges;
}

}  // namespace amhex
