// Merge sets of virtual vertices. Paper: section 5.1, "Vertex Merging".
//
// A union-find whose sets also know their members (as rings) and the box around them, because a
// merge is refused when it would collapse a diagonal or stretch a set over more than a cell.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "geometry/cubes.h"

namespace amhex {

// Virtual vertices to be merged together, pairwise: the four corners of two matched faces.
using CornerPairs = std::array<std::pair<int, int>, 4>;

// What a merge may do to a cube that gets two corners in one set.
enum class Collapse { kForbidden, kEdgesOnly };

class MergeSets {
 public:
  explicit MergeSets(const Cubes& cubes);

  int Find(int virtual_vertex) const;
  // True if merging all pairs keeps every law above. O(members of the sets involved).
  bool CanMerge(const CornerPairs& pairs, Collapse collapse) const;
  void Merge(const CornerPairs& pairs);

 private:
  struct Box {
    Vec3d low, high;
  };
  void Unite(int a, int b);
  bool GroupIsAllowed(const std::vector<int>& roots, Collapse collapse) const;

  const Cubes& cubes_;
  mutable std::vector<int> parent_;
  std::vector<int> size_;
  std::vector<int> ring_next_;  // next member of the same set, cyclic
  std::vector<Box> box_;        // valid at roots
};

}  // namespace amhex
