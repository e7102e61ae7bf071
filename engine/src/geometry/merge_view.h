// Merge sets of virtual vertices (merge_sets.h) as plain arrays, and how two faces are glued;
// usable where bodies run. Paper: section 5.1, "Vertex Merging".
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "base/array_view.h"
#include "base/platform.h"
#include "geometry/cubes_view.h"

namespace amhex {

// Virtual vertices to be merged together.
struct CornerPair {
  int32_t first = 0, second = 0;
};
// The four corners of two matched faces.
using CornerPairs = std::array<CornerPair, 4>;

// What a merge may do to a cube that gets two corners in one set.
enum class Collapse : uint8_t { kForbidden, kEdgesOnly };

// Two faces of different cubes that may be glued, and how.
struct FacePair {
  double score = 0;  // eq. 5 over four mean cell sizes, or a gap in those: lower is better
  int32_t cube_a = 0;
  int32_t cube_b = 0;
  uint8_t direction_a = 0;
  uint8_t direction_b = 0;
  uint8_t rotation = 0;      // corner q of face a meets corner (rotation + 4 - q) % 4 of face b
  uint8_t first_corner = 0;  // of face a, that is paired first
  uint8_t is_cut = 0;        // 1: only while the first two pairs are merged already

  AMHEX_HD int64_t FaceA() const { return 6 * int64_t{cube_a} + direction_a; }
  AMHEX_HD int64_t FaceB() const { return 6 * int64_t{cube_b} + direction_b; }
};

AMHEX_HD inline CornerPairs CornersToMerge(const FacePair& pair) {
  CornerPairs corners;
  for (int q = 0; q < 4; ++q) {
    const int at = (pair.first_corner + q) % 4;
    corners[q].first = 8 * pair.cube_a + CornerOfFace(pair.direction_a, at);
    corners[q].second =
        8 * pair.cube_b + CornerOfFace(pair.direction_b, (pair.rotation + 4 - at) % 4);
  }
  return corners;
}

AMHEX_HD inline bool IsCubeEdge(int corner_a, int corner_b) {
  // Bit c of the mask of a corner: an edge joins it with corner c (volume_mesh.h).
  constexpr uint8_t kJoined[8] = {0x1A, 0x25, 0x4A, 0x85, 0xA1, 0x52, 0xA4, 0x58};
  return (kJoined[corner_a] >> corner_b & 1) != 0;
}

// A union-find whose sets also know their members, as rings, and the box around them. Whoever
// changes sets owns them: nobody else may change them at the same time, or look into them.
struct MergeView {
  CubesView cubes;
  ArrayView<int32_t> parent;     // [virtual vertex]
  ArrayView<int32_t> size;       // valid at roots
  ArrayView<int32_t> ring_next;  // next member of the same set, cyclic
  ArrayView<Vec3d> low, high;    // boxes, valid at roots
  ArrayView<int32_t> matches;    // [face] the face that it is glued to, -1 while open

  AMHEX_HD void Start(int64_t v) const {
    const auto vertex = static_cast<int32_t>(v);
    parent[v] = ring_next[v] = vertex;
    size[v] = 1;
    low[v] = high[v] = cubes.VirtualVertex(vertex);
  }

  // Sets are small, and of two the smaller one goes below the larger: paths are short.
  AMHEX_HD int32_t Find(int32_t v) const {
    while (parent[v] != v) v = parent[v];
    return v;
  }

  AMHEX_HD bool IsOpen(const FacePair& pair) const {
    return matches[pair.FaceA()] < 0 && matches[pair.FaceB()] < 0;
  }

  // Whether the faces were glued; not if one has been already or a law is against it.
  AMHEX_HD bool TryGlue(const FacePair& pair, Collapse collapse) const {
    if (!IsOpen(pair)) return false;
    const CornerPairs corners = CornersToMerge(pair);
    for (int q = 0; q < 2 && pair.is_cut != 0; ++q) {
      if (Find(corners[q].first) != Find(corners[q].second)) return false;
    }
    if (!CanMerge(corners, collapse)) return false;
    Merge(corners);
    matches[pair.FaceA()] = static_cast<int32_t>(pair.FaceB());
    matches[pair.FaceB()] = static_cast<int32_t>(pair.FaceA());
    return true;
  }

  // True if merging all pairs collapses no diagonal and stretches no set over more than a cell.
  AMHEX_HD bool CanMerge(const CornerPairs& pairs, Collapse collapse) const {
    // The four pairs may join the same sets; find the groups they would form together.
    int32_t root[8], group[8];
    int count = 0;
    for (const CornerPair& pair : pairs) {
      const int32_t a = group[Slot(Find(pair.first), root, group, count)];
      const int32_t b = group[Slot(Find(pair.second), root, group, count)];
      for (int i = 0; i < count; ++i) {
        if (group[i] == b) group[i] = a;
      }
    }
    for (int g = 0; g < count; ++g) {
      int32_t together[8];
      int set_count = 0;
      for (int i = 0; i < count; ++i) {
        if (group[i] == g) together[set_count++] = root[i];
      }
      if (set_count > 1 && !GroupIsAllowed(together, set_count, collapse)) return false;
    }
    return true;
  }

  AMHEX_HD void Merge(const CornerPairs& pairs) const {
    for (const CornerPair& pair : pairs) Unite(pair.first, pair.second);
  }

  // Calls visit(member) for all members of the set of `root`, which come first.
  template <class Visit>
  AMHEX_HD void VisitMembers(int32_t root, const Visit& visit) const {
    int32_t v = root;
    do {
      visit(v);
      v = ring_next[v];
    } while (v != root);
  }

 private:
  AMHEX_HD static int Slot(int32_t wanted, int32_t* root, int32_t* group, int& count) {
    for (int i = 0; i < count; ++i) {
      if (root[i] == wanted) return i;
    }
    root[count] = wanted;
    group[count] = count;
    return count++;
  }

  AMHEX_HD bool GroupIsAllowed(const int32_t* roots, int count, Collapse collapse) const {
    // A set wider than this many mean cell sizes would pull its cubes out of shape.
    constexpr double kMaxSetSpan = 1.3;
    Vec3d least = low[roots[0]], most = high[roots[0]];
    double size_sum = 0;
    int64_t members = 0;
    for (int i = 0; i < count; ++i) {
      least = ComponentMin(least, low[roots[i]]);
      most = ComponentMax(most, high[roots[i]]);
      VisitMembers(roots[i], [&](int32_t v) {
        size_sum += 2 * cubes.mean_half[v / 8];
        ++members;
      });
    }
    const double mean_size = size_sum / static_cast<double>(members);
    const Vec3d extent = most - least;
    if (Larger(Larger(extent.x, extent.y), extent.z) > kMaxSetSpan * mean_size) return false;
    bool is_allowed = true;
    for (int i = 0; i < count && is_allowed; ++i) {
      VisitMembers(roots[i], [&](int32_t v) {
        for (int j = i; j < count; ++j) is_allowed &= FitsInto(v, roots[j], collapse);
      });
    }
    return is_allowed;
  }

  // Whether the cube of `v` bears that also the members of another set (or its own) are merged with
  // it.
  AMHEX_HD bool FitsInto(int32_t v, int32_t root, Collapse collapse) const {
    bool fits = true;
    VisitMembers(root, [&](int32_t other) {
      if (other == v || other / 8 != v / 8) return;
      fits &= collapse != Collapse::kForbidden && IsCubeEdge(v % 8, other % 8);
    });
    return fits;
  }

  AMHEX_HD void Unite(int32_t first, int32_t second) const {
    const int32_t a = Find(first), b = Find(second);
    if (a == b) return;
    const bool is_below = size[a] < size[b] || (size[a] == size[b] && b < a);
    const int32_t top = is_below ? b : a, below = is_below ? a : b;
    parent[below] = top;
    size[top] += size[below];
    const int32_t next = ring_next[top];
    ring_next[top] = ring_next[below];
    ring_next[below] = next;
    low[top] = ComponentMin(low[top], low[below]);
    high[top] = ComponentMax(high[top], high[below]);
  }
};

}  // namespace amhex
