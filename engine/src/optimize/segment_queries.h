// Closest points on a set of line segments, by a bounding volume hierarchy.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "optimize/feature_view.h"

namespace amhex {

// Immutable after construction; queries are safe from any number of threads.
class SegmentQueries {
 public:
  using Segment = LineSegment;

  explicit SegmentQueries(std::vector<Segment> segments);

  const Segment& segment(int32_t index) const { return segments_[index]; }
  // O(log n) expected. Ties go to the segment that comes first in the hierarchy.
  SegmentPoint Closest(const Vec3d& p, double reach) const { return view().Closest(p, reach); }

  // The same where bodies run; must not outlive this.
  SegmentView view() const {
    return {{segments_.data(), static_cast<int64_t>(segments_.size())},
            {nodes_.data(), static_cast<int64_t>(nodes_.size())}};
  }

 private:
  using Node = SegmentNode;
  int32_t Build(int32_t begin, int32_t end);

  std::vector<Segment> segments_;  // in the order of the leaves
  std::vector<Node> nodes_;
};

}  // namespace amhex
