#include "output/sharp_edges.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "input/sharp_features.h"
#include "optimize/segment_queries.h"

namespace amhex {
namespace {

// Edge lengths.
constexpr double kSharpEdgeSpacing = 0.25;

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
  const std::vector<SharpEdge> followed = FollowedEdges(hull);
  const SegmentQueries edges = BoundaryEdges(boundary, vertices);
  double squares = 0, weight = 0;
  for (size_t e = 0; e < followed.size(); ++e) {
    poll.At(static_cast<int64_t>(e));
    const SharpEdge& edge = followed[e];
    const Vec3d& a = hull.vertices[edge.vertex_a];
    const Vec3d along = hull.vertices[edge.vertex_b] - a;
    const double length = Norm(along);
    const int count = std::max(1, static_cast<int>(std::ceil(length / kSharpEdgeSpacing)));
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
