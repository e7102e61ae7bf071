#include "optimize/segment_queries.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace amhex {
namespace {

constexpr int32_t kLeafSegments = 4;
// Halving by count bounds the depth by log2 of the largest int32_t.
constexpr int kStackSize = 64;

double SquaredDistanceToBox(const Vec3d& p, const Box3d& box) {
  Vec3d outside;
  for (int a = 0; a < 3; ++a) {
    outside[a] = std::max({box.low[a] - p[a], 0.0, p[a] - box.high[a]});
  }
  return SquaredNorm(outside);
}

Vec3d ClosestOn(const SegmentQueries::Segment& segment, const Vec3d& p) {
  const Vec3d along = segment.second - segment.first;
  const double squared_length = SquaredNorm(along);
  if (!(squared_length > 0)) return segment.first;
  const double t = Dot(p - segment.first, along) / squared_length;
  return segment.first + along * std::clamp(t, 0.0, 1.0);
}

}  // namespace

SegmentQueries::SegmentQueries(std::vector<Segment> segments) : segments_(std::move(segments)) {
  if (!segments_.empty()) Build(0, static_cast<int32_t>(segments_.size()));
}

int32_t SegmentQueries::Build(int32_t begin, int32_t end) {
  const int32_t id = static_cast<int32_t>(nodes_.size());
  Node node;
  node.begin = begin, node.end = end;
  for (int32_t i = begin; i < end; ++i) {
    node.box.Extend(segments_[i].first);
    node.box.Extend(segments_[i].second);
  }
  nodes_.push_back(node);
  if (end - begin <= kLeafSegments) return id;
  const Vec3d extent = node.box.Extent();
  const int axis =
      extent.x >= extent.y ? (extent.x >= extent.z ? 0 : 2) : (extent.y >= extent.z ? 1 : 2);
  const int32_t middle = begin + (end - begin) / 2;
  std::stable_sort(segments_.begin() + begin, segments_.begin() + end,
                   [axis](const Segment& a, const Segment& b) {
                     return a.first[axis] + a.second[axis] < b.first[axis] + b.second[axis];
                   });
  Build(begin, middle);
  const int32_t right = Build(middle, end);
  nodes_[id].right = right;
  return id;
}

SegmentPoint SegmentQueries::Closest(const Vec3d& p, double reach) const {
  SegmentPoint best;
  double best_squared = reach < 1e150 ? reach * reach : 1e300;
  std::array<int32_t, kStackSize> stack{};
  int size = nodes_.empty() ? 0 : 1;
  while (size > 0) {
    const int32_t id = stack[--size];
    const Node& node = nodes_[id];
    if (SquaredDistanceToBox(p, node.box) > best_squared) continue;
    if (node.right >= 0) {
      const bool left_first = SquaredDistanceToBox(p, nodes_[id + 1].box) <=
                              SquaredDistanceToBox(p, nodes_[node.right].box);
      stack[size++] = left_first ? node.right : id + 1;
      stack[size++] = left_first ? id + 1 : node.right;
      continue;
    }
    for (int32_t i = node.begin; i < node.end; ++i) {
      const Vec3d q = ClosestOn(segments_[i], p);
      const double squared = SquaredNorm(q - p);
      if (squared > best_squared || (squared == best_squared && best.segment >= 0)) continue;
      best_squared = squared;
      best = {q, i, std::sqrt(squared)};
    }
  }
  return best;
}

}  // namespace amhex
