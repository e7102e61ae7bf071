#include "optimize/segment_queries.h"

#include <algorithm>
#include <utility>

namespace amhex {
namespace {

constexpr int32_t kLeafSegments = 4;

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

}  // namespace amhex
