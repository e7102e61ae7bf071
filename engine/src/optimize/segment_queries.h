// Closest points on a set of line segments, by a bounding volume hierarchy.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {

struct SegmentPoint {
  Vec3d point;
  int32_t segment = -1;  // -1: none within reach
  double distance = 0;
};

// Immutable after construction; queries are safe from any number of threads.
class SegmentQueries {
 public:
  using Segment = std::pair<Vec3d, Vec3d>;

  explicit SegmentQueries(std::vector<Segment> segments);

  const Segment& segment(int32_t index) const { return segments_[index]; }
  // O(log n) expected. Ties go to the segment that comes first in the hierarchy.
  SegmentPoint Closest(const Vec3d& p, double reach) const;

 private:
  struct Node {
    Box3d box;
    int32_t begin = 0, end = 0;  // segments
    int32_t right = -1;          // the left child follows its parent; -1 on leaves
  };
  int32_t Build(int32_t begin, int32_t end);

  std::vector<Segment> segments_;  // in the order of the leaves
  std::vector<Node> nodes_;
};

}  // namespace amhex
