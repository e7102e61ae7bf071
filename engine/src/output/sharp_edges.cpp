#include "output/sharp_edges.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "optimize/segment_queries.h"

namespace amhex {
namespace {

// In edge lengths, as vertex placement has it: what is shorter is not followed.
constexpr double kMinChainLength = 3.0;
constexpr double kSampleSpacing = 0.25;

double LengthOf(const Hull& hull, const SharpEdge& edge) {
  return Norm(hull.vertices[edge.vertex_b] - hull.vertices[edge.vertex_a]);
}

// [sharp edge] the total length of all sharp edges connected with it.
std::vector<double> ChainLengths(const Hull& hull) {
  std::vector<int32_t> parent(hull.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](int32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const SharpEdge& edge : hull.sharp_edges) parent[find(edge.vertex_a)] = find(edge.vertex_b);
  std::vector<double> total(hull.vertices.size(), 0.0);
  for (const SharpEdge& edge : hull.sharp_edges) {
    total[find(edge.vertex_a)] += LengthOf(hull, edge);
  }
  std::vector<double> lengths;
  for (const SharpEdge& edge : hull.sharp_edges) lengths.push_back(total[find(edge.vertex_a)]);
  return lengths;
}

SegmentQueries BoundaryEdges(const std::vector<BoundaryFace>& boundary,
                             const std::vector<Vec3d>& vertices) {
  std::vector<SegmentQueries::Segment> segments;
  for (const BoundaryFace& entry : boundary) {
    const auto& face = entry.face;
    for (int j = 0; j < face.count; ++j) {
      const int32_t a = face.v[j], b = face.v[(j + 1) % face.count];
      // Every boundary edge has two faces that run it opposite ways.
      if (a < b) segments.push_back({vertices[a], vertices[b]});
    }
  }
  return SegmentQueries(std::move(segments));
}

}  // namespace

SharpEdgeDeviation MeasureSharpEdges(const Hull& hull, const std::vector<BoundaryFace>& boundary,
                                     const std::vector<Vec3d>& vertices, const StopPoll& poll) {
  SharpEdgeDeviation deviation;
  if (hull.sharp_edges.empty() || boundary.empty()) return deviation;
  const std::vector<double> chain_lengths = ChainLengths(hull);
  const SegmentQueries edges = BoundaryEdges(boundary, vertices);
  double squares = 0, weight = 0;
  for (size_t e = 0; e < hull.sharp_edges.size(); ++e) {
    poll.At(static_cast<int64_t>(e));
    if (chain_lengths[e] < kMinChainLength) continue;
    const SharpEdge& edge = hull.sharp_edges[e];
    const Vec3d& a = hull.vertices[edge.vertex_a];
    const Vec3d along = hull.vertices[edge.vertex_b] - a;
    const double length = LengthOf(hull, edge);
    const int count = std::max(1, static_cast<int>(std::ceil(length / kSampleSpacing)));
    for (int k = 0; k < count; ++k) {
      const Vec3d sample = a + along * ((k + 0.5) / count);
      const double distance = edges.Closest(sample, hull.box.Diagonal()).distance;
      squares += distance * distance * (length / count);
      weight += length / count;
      deviation.maximum = std::max(deviation.maximum, distance);
    }
  }
  if (weight > 0) deviation.root_mean_square = std::sqrt(squares / weight);
  return deviation;
}

}  // namespace amhex
