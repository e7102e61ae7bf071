// The hull's patches, creases and corners (hull_features.h) as plain data, and what vertex
// placement asks them; usable where bodies run.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include "base/array_view.h"
#include "base/platform.h"
#include "input/hull_view.h"
#include "input/triangle_math.h"

namespace amhex {

struct SegmentPoint {
  Vec3d point;
  int32_t segment = -1;  // -1: none within reach
  double distance = 0;
};

struct LineSegment {
  Vec3d first, second;
};

struct SegmentNode {
  Box3d box;
  int32_t begin = 0, end = 0;  // segments
  int32_t right = -1;          // the left child follows its parent; -1 on leaves
};

// Halving by count bounds the depth by log2 of the largest int32_t.
inline constexpr int kSegmentStackSize = 64;

// The hierarchy of segment_queries.h.
struct SegmentView {
  ArrayView<const LineSegment> segments;  // in the order of the leaves
  ArrayView<const SegmentNode> nodes;

  AMHEX_HD SegmentPoint Closest(const Vec3d& p, double reach) const {
    SegmentPoint best;
    double best_squared = reach < 1e150 ? reach * reach : 1e300;
    int32_t stack[kSegmentStackSize];
    int size = nodes.empty() ? 0 : 1;
    stack[0] = 0;
    while (size > 0) {
      const int32_t id = stack[--size];
      const SegmentNode& node = nodes[id];
      if (SquaredDistanceTo(node.box, p) > best_squared) continue;
      if (node.right >= 0) {
        const bool left_first =
            SquaredDistanceTo(nodes[id + 1].box, p) <= SquaredDistanceTo(nodes[node.right].box, p);
        stack[size++] = left_first ? node.right : id + 1;
        stack[size++] = left_first ? id + 1 : node.right;
        continue;
      }
      for (int32_t i = node.begin; i < node.end; ++i) {
        const Vec3d q = ClosestPointOnSegment(p, segments[i].first, segments[i].second);
        const double squared = SquaredNorm(q - p);
        if (squared > best_squared || (squared == best_squared && best.segment >= 0)) continue;
        best_squared = squared;
        best = {q, i, std::sqrt(squared)};
      }
    }
    return best;
  }

 private:
  AMHEX_HD static double SquaredDistanceTo(const Box3d& box, const Vec3d& p) {
    Vec3d outside;
    for (int a = 0; a < 3; ++a) {
      outside[a] = Larger(Larger(box.low[a] - p[a], 0.0), p[a] - box.high[a]);
    }
    return SquaredNorm(outside);
  }
};

// The creases between two patches, `low` <= `high`.
struct CreaseView {
  int32_t low = 0, high = 0;
  SegmentView segments;
};

struct FeatureView {
  HullView hull;
  ArrayView<const HullView> patches;
  ArrayView<const CreaseView> creases;  // ascending by low, then high
  ArrayView<const Vec3d> corners;

  // Null if there is none.
  AMHEX_HD const CreaseView* CreaseBetween(int32_t patch_a, int32_t patch_b) const {
    const int32_t low = Smaller(patch_a, patch_b), high = Larger(patch_a, patch_b);
    int64_t begin = 0, end = creases.size;
    while (begin < end) {
      const int64_t middle = (begin + end) / 2;
      const CreaseView& crease = creases[middle];
      if (crease.low < low || (crease.low == low && crease.high < high)) {
        begin = middle + 1;
      } else {
        end = middle;
      }
    }
    if (begin == creases.size) return nullptr;
    return creases[begin].low == low && creases[begin].high == high ? &creases[begin] : nullptr;
  }
};

}  // namespace amhex
