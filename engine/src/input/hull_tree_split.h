// Bodies that split all nodes of one level of the hull's hierarchy at once (hull_tree_impl.h).
#pragma once

#include <array>
#include <cstdint>

#include "base/array_view.h"
#include "base/ordered_bits.h"
#include "input/hull_split.h"

namespace amhex {

// A box that many extend at once. Bits of the order of numbers, so that the atomics are those of
// integers; zeros have one sign.
struct OrderedBox {
  std::array<uint64_t, 3> low, high;

  AMHEX_HD void Clear() {
    for (int axis = 0; axis < 3; ++axis) low[axis] = ~uint64_t{0}, high[axis] = 0;
  }
  AMHEX_HD void Extend(const HullBox& other) {
    for (int axis = 0; axis < 3; ++axis) {
      AtomicMin(&low[axis], OrderedBits(other.low[axis]));
      AtomicMax(&high[axis], OrderedBits(other.high[axis]));
    }
  }
  // Of a box that holds something.
  AMHEX_HD HullBox Box() const {
    HullBox box;
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = NumberOfOrder(low[axis]);
      box.high[axis] = NumberOfOrder(high[axis]);
    }
    return box;
  }
};

enum class HullSplitKind : int32_t { kBins, kHalves, kSortedHalves };

// A node that becomes two.
struct HullSplit {
  int32_t begin, end;  // its triangles
  int32_t left;        // its left child; the right one is next
  HullSplitKind kind;
  HullBins bins;
  int32_t best_bin;
  OrderedBox centres;
  std::array<OrderedBox, kHullBinCount> box;
  std::array<int32_t, kHullBinCount> count;

  AMHEX_HD int32_t half() const { return begin + (end - begin) / 2; }
};

// Its bins as the heuristic wants them.
struct BinsOf {
  const HullSplit& split;
  AMHEX_HD HullBin operator()(int bin) const {
    HullBin filled;
    filled.count = split.count[bin];
    if (filled.count > 0) filled.box = split.box[bin].Box();
    return filled;
  }
};

// Nodes in the order in which they come to be, level by level.
struct HullTreeNodes {
  ArrayView<int32_t> begin, end;
  ArrayView<int32_t> left;  // child; -1 on leaves
};

// How far the splitting is: places in an array of counts.
inline constexpr int kLevelDepth = 0;
inline constexpr int kLevelFirst = 1;   // node
inline constexpr int kLevelNodes = 2;   // zero once all nodes below are leaves
inline constexpr int kLevelSplits = 3;  // of them
// 1 where triangles are to be sorted before the level goes on: nothing happens until then.
inline constexpr int kMustSort = 4;
inline constexpr int kLiveNodes = 5;  // of the level; this and the next are zero while it waits
inline constexpr int kLiveSplits = 6;
inline constexpr int kLevelBegins = 7;  // nodes before each level, and all
// Two more levels than it takes to halve 2^31 triangles below kHullBalancedDepth would do.
inline constexpr int kMostHullLevels = kHullStackSize;
inline constexpr int kLevelCounts = kLevelBegins + kMostHullLevels + 1;

// Per place: one node, the root, is to be looked at.
struct BeginLevelsBody {
  ArrayView<int64_t> counts;
  AMHEX_HD void operator()(int64_t place) const {
    const bool is_one = place == kLevelNodes || place == kLiveNodes || place == kLevelBegins + 1;
    counts[place] = is_one ? 1 : 0;
  }
};

struct HullTreeLevel {
  HullTreeNodes nodes;
  ArrayView<int64_t> counts;
  ArrayView<const HullTriangle> triangles;
  ArrayView<int32_t> order;  // the triangle at each place
  ArrayView<int32_t> place;  // first the node there, then its split; -1 if it is or was a leaf
  ArrayView<int32_t> split;  // [node of the level, and one more] the splits before it
  ArrayView<HullSplit> splits;
  ArrayView<int32_t> to_left;  // [place, and one more] 1 if it goes to the left, then their sums

  AMHEX_HD const HullTriangle& TriangleAt(int64_t i) const { return triangles[order[i]]; }
  AMHEX_HD bool MustSort() const { return counts[kMustSort] != 0; }
  AMHEX_HD bool IsOver() const { return counts[kLevelNodes] == 0; }
};

// As many as a level may have of nodes, and one more.
struct FindInnerNodesBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t j) const {
    const HullTreeNodes& nodes = level.nodes;
    const int64_t node = level.counts[kLevelFirst] + j;
    const bool is_inner =
        j < level.counts[kLiveNodes] && nodes.end[node] - nodes.begin[node] > kHullLeafTriangles;
    level.split[j] = is_inner ? 1 : 0;
  }
};

// One element, after the sums of what the last one found.
struct CountSplitsBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t /*index*/) const {
    if (level.MustSort()) return;
    const int64_t splits = level.split[level.counts[kLevelNodes]];
    level.counts[kLevelSplits] = level.counts[kLiveSplits] = splits;
  }
};

// Per node of the level.
struct BeginSplitsBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t j) const {
    const int64_t node = level.counts[kLevelFirst] + j;
    const int32_t number = level.split[j];
    if (level.split[j + 1] == number) {
      level.nodes.left[node] = -1;
      return;
    }
    HullSplit& split = level.splits[number];
    split.begin = level.nodes.begin[node];
    split.end = level.nodes.end[node];
    split.left =
        static_cast<int32_t>(level.counts[kLevelFirst] + level.counts[kLevelNodes]) + 2 * number;
    level.nodes.left[node] = split.left;
    split.centres.Clear();
    for (int bin = 0; bin < kHullBinCount; ++bin) split.box[bin].Clear(), split.count[bin] = 0;
  }
};

// Per triangle.
struct BoundCentresBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t i) const {
    if (level.MustSort()) return;
    const int32_t node = level.place[i];
    const bool is_split = node >= 0 && level.nodes.left[node] >= 0;
    level.place[i] = is_split ? level.split[node - level.counts[kLevelFirst]] : -1;
    if (!is_split) return;
    const Vec3d centre = BoxCentre(level.TriangleAt(i));
    level.splits[level.place[i]].centres.Extend({centre, centre});
  }
};

// Per split.
struct ChooseAxisBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t s) const {
    level.splits[s].bins = HullBins::Over(level.splits[s].centres.Box());
  }
};

// Per triangle.
struct FillBinsBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t i) const {
    if (level.place[i] < 0 || level.MustSort()) return;
    HullSplit& split = level.splits[level.place[i]];
    if (!split.bins.CanSplit()) return;
    const HullTriangle& t = level.TriangleAt(i);
    const int bin = split.bins.BinOf(t);
    AtomicAdd(&split.count[bin], 1);
    HullBox box;
    box.Extend(t);
    split.box[bin].Extend(box);
  }
};

// Per split. Several may say that there is something to sort, all the same.
struct ChooseBinBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t s) const {
    HullSplit& split = level.splits[s];
    split.kind = HullSplitKind::kHalves;
    if (!split.bins.CanSplit()) return;
    split.best_bin = BestBin(split.end - split.begin, BinsOf{split});
    const bool has_bins = split.best_bin >= 0 && level.counts[kLevelDepth] < kHullBalancedDepth;
    split.kind = has_bins ? HullSplitKind::kBins : HullSplitKind::kSortedHalves;
    if (!has_bins) level.counts[kMustSort] = 1;
  }
};

// What sorts the triangles of nodes that are to be sorted by their centres, and leaves all others
// where they are: three stable sorts, one per word.
enum class CentreWord : int32_t { kLow, kHigh, kRange };

struct CentreKeysBody {
  HullTreeLevel level;
  CentreWord word;
  ArrayView<const int32_t> sorted;  // places, sorted by the words before; empty: none are
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;
  AMHEX_HD void operator()(int64_t j) const {
    const int32_t i = sorted.empty() ? static_cast<int32_t>(j) : sorted[j];
    id[j] = i;
    const int32_t s = level.place[i];
    const bool is_sorted = s >= 0 && level.splits[s].kind == HullSplitKind::kSortedHalves;
    if (word == CentreWord::kRange) {
      key[j] = static_cast<uint32_t>(is_sorted ? level.splits[s].begin : i);
      return;
    }
    uint64_t bits = 0;
    if (is_sorted) bits = OrderedBits(BoxCentre(level.TriangleAt(i))[level.splits[s].bins.axis]);
    key[j] = static_cast<uint32_t>(word == CentreWord::kLow ? bits : bits >> 32);
  }
};

struct TakeOrderBody {
  ArrayView<const int32_t> sorted;
  ArrayView<const int32_t> order;
  ArrayView<int32_t> next;
  AMHEX_HD void operator()(int64_t i) const { next[i] = order[sorted[i]]; }
};

// Per triangle, and one more.
struct ChooseSidesBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t i) const {
    level.to_left[i] = i < level.order.size && GoesLeft(i) ? 1 : 0;
  }

 private:
  AMHEX_HD bool GoesLeft(int64_t i) const {
    if (level.place[i] < 0) return false;
    const HullSplit& split = level.splits[level.place[i]];
    if (split.kind != HullSplitKind::kBins) return i < split.half();
    return split.bins.BinOf(level.TriangleAt(i)) < split.best_bin;
  }
};

// Per triangle: those that go to the same side keep their order. All stay where they are while some
// are to be sorted.
struct PartBody {
  HullTreeLevel level;
  ArrayView<int32_t> next_order, next_place;
  AMHEX_HD void operator()(int64_t i) const {
    int64_t to = i;
    int32_t node = -1;
    if (level.MustSort()) {
      node = level.place[i];
    } else if (level.place[i] >= 0) {
      const HullSplit& split = level.splits[level.place[i]];
      const int32_t before = level.to_left[i] - level.to_left[split.begin];
      const int32_t lefts = level.to_left[split.end] - level.to_left[split.begin];
      const bool is_left = level.to_left[i + 1] > level.to_left[i];
      to = is_left ? split.begin + before : i + lefts - before;
      node = split.left + (is_left ? 0 : 1);
    }
    next_order[to] = level.order[i];
    next_place[to] = node;
  }
};

// Per split.
struct BeginChildrenBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t s) const {
    if (level.MustSort()) return;
    const HullSplit& split = level.splits[s];
    const int32_t middle = split.begin + level.to_left[split.end] - level.to_left[split.begin];
    level.nodes.begin[split.left] = split.begin;
    level.nodes.end[split.left] = middle;
    level.nodes.begin[split.left + 1] = middle;
    level.nodes.end[split.left + 1] = split.end;
  }
};

// One element.
struct EndLevelBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t /*index*/) const {
    const ArrayView<int64_t>& counts = level.counts;
    if (level.MustSort()) {
      counts[kLiveNodes] = counts[kLiveSplits] = 0;
      return;
    }
    if (level.IsOver()) return;
    counts[kLevelFirst] += counts[kLevelNodes];
    counts[kLevelNodes] = counts[kLiveNodes] = 2 * counts[kLevelSplits];
    ++counts[kLevelDepth];
    counts[kLevelBegins + counts[kLevelDepth] + 1] = counts[kLevelFirst] + counts[kLevelNodes];
  }
};

// One element, when they have been sorted.
struct GoOnBody {
  HullTreeLevel level;
  AMHEX_HD void operator()(int64_t /*index*/) const {
    level.counts[kMustSort] = 0;
    level.counts[kLiveSplits] = level.counts[kLevelSplits];
  }
};

}  // namespace amhex
