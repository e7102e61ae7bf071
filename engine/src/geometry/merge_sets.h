// Merge sets of virtual vertices (merge_view.h) on the host.
#pragma once

#include <array>
#include <vector>

#include "geometry/cubes.h"
#include "geometry/merge_view.h"

namespace amhex {

// [cube][direction] 6 * other cube + direction over there; -1 while open.
using FaceMatches = std::vector<std::array<int32_t, 6>>;

// Every virtual vertex by itself at first, all faces open. The cubes must outlive this.
class MergeSets {
 public:
  explicit MergeSets(const Cubes& cubes);
  MergeSets(const MergeSets&) = delete;
  MergeSets& operator=(const MergeSets&) = delete;

  const MergeView& view() const { return view_; }
  const FaceMatches& matches() const { return matches_; }

 private:
  std::vector<int32_t> parent_, size_, ring_next_;
  std::vector<Vec3d> low_, high_;
  FaceMatches matches_;
  MergeView view_;  // of all of them
};

}  // namespace amhex
