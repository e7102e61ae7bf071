#include "input/build_hull_tree.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <utility>

#include "base/loop_polling.h"
#include "input/edges_balance.h"
#include "input/hull_split.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

// Subtrees of more triangles than this are built by a task of their own.
constexpr int32_t kTrianglesPerTask = 1024;
constexpr size_t kItemsPerBlock = 2048;
constexpr size_t kNodesPerBlock = 256;
// Ranges of more are split by several threads, in blocks of so many.
constexpr int32_t kTrianglesSplitTogether = 16384;
constexpr int32_t kTrianglesPerPart = 4096;

HullTriangle TriangleAt(const std::vector<Vec3d>& vertices, const std::array<int32_t, 3>& t) {
  return {vertices[static_cast<size_t>(t[0])], vertices[static_cast<size_t>(t[1])],
          vertices[static_cast<size_t>(t[2])]};
}

// A box as six numbers of which the least are kept: its low corner and the high one, negated.
struct Bounds {
  std::array<double, 6> least = {1e300, 1e300, 1e300, 1e300, 1e300, 1e300};

  void Extend(const Bounds& other) {
    for (size_t i = 0; i < 6; ++i) {
      least[i] = least[i] < other.least[i] ? least[i] : other.least[i];
    }
  }
  void ExtendTo(const std::array<double, 3>& p) {
    for (size_t i = 0; i < 3; ++i) {
      least[i] = least[i] < p[i] ? least[i] : p[i];
      least[i + 3] = least[i + 3] < -p[i] ? least[i + 3] : -p[i];
    }
  }
  HullBox Box() const {
    return {{least[0], least[1], least[2]}, {-least[3], -least[4], -least[5]}};
  }
};

// A triangle's box with its number. Boxes are all that splitting asks for.
struct Item {
  Bounds box;
  int32_t original = 0;

  // As BoxCentre.
  double Centre(size_t axis) const { return box.least[axis] - box.least[axis + 3]; }
  std::array<double, 3> Centre() const { return {Centre(0), Centre(1), Centre(2)}; }
};

// Of the triangles of a node.
struct Extent {
  Bounds box, centres;
  int32_t count = 0;

  void Extend(const Extent& other) {
    box.Extend(other.box), centres.Extend(other.centres), count += other.count;
  }
  void Extend(const Item& item) { box.Extend(item.box), centres.ExtendTo(item.Centre()), ++count; }
};

class TreeBuilder {
 public:
  TreeBuilder(std::vector<Item> items, const StopPoll& poll)
      : poll_(poll), items_(std::move(items)), moved_(items_.size()) {}

  std::vector<HullNode> Run() {
    std::vector<HullNode> nodes;
    if (items_.empty()) return nodes;
    nodes.reserve(items_.size());
    const Range all{0, static_cast<int32_t>(items_.size())};
    Build(all, ExtentOf(all), 0, &nodes);
    return nodes;
  }
  // In leaf order, after Run.
  const std::vector<Item>& items() const { return items_; }

 private:
  struct Range {
    int32_t begin, end;
    int32_t size() const { return end - begin; }
  };
  using Bins = std::array<Extent, kHullBinCount>;
  struct Parts {
    Extent left, right;
  };

  Extent ExtentOf(const Range& range) const {
    Extent extent;
    for (int32_t i = range.begin; i < range.end; ++i) {
      poll_.At(i);
      extent.Extend(items_[static_cast<size_t>(i)]);
    }
    return extent;
  }

  // Appends the subtree over a range of the items, its root first.
  void Build(const Range& range, const Extent& extent, int depth, std::vector<HullNode>* nodes) {
    const size_t id = nodes->size();
    const HullBox box = extent.box.Box();
    nodes->push_back({box.low, box.high, range.begin, range.end, -1});
    if (range.end - range.begin <= kHullLeafTriangles) return;

    const Parts parts = Split(range, extent, depth);
    const int32_t middle = range.begin + parts.left.count;
    std::vector<HullNode> right_subtree;
    const bool is_large = range.end - range.begin > kTrianglesPerTask;
    const auto build_left = [&] { Build({range.begin, middle}, parts.left, depth + 1, nodes); };
    const auto build_right = [&] {
      Build({middle, range.end}, parts.right, depth + 1, &right_subtree);
    };
    if (is_large) tbb::parallel_invoke(build_left, build_right);
    if (!is_large) build_left();
    const auto right = static_cast<int32_t>(nodes->size());
    (*nodes)[id].right = right;
    if (!is_large) return Build({middle, range.end}, parts.right, depth + 1, nodes);
    for (HullNode& node : right_subtree) {
      if (node.right >= 0) node.right += right;
    }
    nodes->insert(nodes->end(), right_subtree.begin(), right_subtree.end());
  }

  // Reorders the range by the binned surface area heuristic, by halves where that finds no split.
  Parts Split(const Range& range, const Extent& extent, int depth) {
    const HullBins bins = HullBins::Over(extent.centres.Box());
    if (!bins.CanSplit()) return Halves(range);
    const auto axis = static_cast<size_t>(bins.axis);
    const auto bin_of = [&](const Item& item) { return bins.BinAt(item.Centre(axis)); };
    const Bins filled = Filled(range, bin_of);
    const int best_bin = BestBin(range.end - range.begin, [&](int bin) {
      const Extent& of_bin = filled[static_cast<size_t>(bin)];
      return HullBin{of_bin.box.Box(), of_bin.count};
    });
    if (best_bin < 0 || depth >= kHullBalancedDepth) {
      SortAlong(axis, range);
      return Halves(range);
    }
    Parts parts;
    for (int bin = 0; bin < kHullBinCount; ++bin) {
      (bin < best_bin ? parts.left : parts.right).Extend(filled[static_cast<size_t>(bin)]);
    }
    Partition(range, [&](const Item& item) { return bin_of(item) < best_bin; });
    return parts;
  }

  // visit(part, its range) for the parts of a range, side by side where there are many.
  template <class Visit>
  static size_t ForParts(const Range& range, const Visit& visit) {
    if (range.size() <= kTrianglesSplitTogether) {
      visit(size_t{0}, range);
      return 1;
    }
    const auto count = static_cast<size_t>((range.size() - 1) / kTrianglesPerPart) + 1;
    tbb::parallel_for(size_t{0}, count, [&](size_t part) {
      const int32_t begin = range.begin + static_cast<int32_t>(part) * kTrianglesPerPart;
      visit(part, Range{begin, std::min(begin + kTrianglesPerPart, range.end)});
    });
    return count;
  }
  static size_t MostParts(const Range& range) {
    return static_cast<size_t>(range.size() / kTrianglesPerPart) + 1;
  }

  // Boxes and counts do not depend on the order.
  template <class BinOf>
  Bins Filled(const Range& range, const BinOf& bin_of) const {
    std::vector<Bins> of_part(range.size() > kTrianglesSplitTogether ? MostParts(range) : 1);
    ForParts(range, [&](size_t part, const Range& own) {
      poll_.Now();
      for (int32_t i = own.begin; i < own.end; ++i) {
        const Item& item = items_[static_cast<size_t>(i)];
        of_part[part][static_cast<size_t>(bin_of(item))].Extend(item);
      }
    });
    for (size_t part = 1; part < of_part.size(); ++part) {
      for (size_t bin = 0; bin < kHullBinCount; ++bin) {
        of_part[0][bin].Extend(of_part[part][bin]);
      }
    }
    return of_part[0];
  }

  Parts Halves(const Range& range) const {
    const int32_t half = range.begin + (range.end - range.begin) / 2;
    return {ExtentOf({range.begin, half}), ExtentOf({half, range.end})};
  }

  // Stable, so that the hierarchy is reproducible.
  void SortAlong(size_t axis, const Range& range) {
    std::stable_sort(
        items_.begin() + range.begin, items_.begin() + range.end,
        [axis](const Item& a, const Item& b) { return a.Centre(axis) < b.Centre(axis); });
  }
  template <class IsLeft>
  void Partition(const Range& range, const IsLeft& is_left) {
    if (range.size() > kTrianglesSplitTogether) return PartitionTogether(range, is_left);
    auto left = items_.begin() + range.begin;
    const auto moved = moved_.begin() + range.begin;
    auto right = moved;
    for (int32_t i = range.begin; i < range.end; ++i) {
      poll_.At(i);
      const Item& item = items_[static_cast<size_t>(i)];
      if (is_left(item)) {
        *left++ = item;
      } else {
        *right++ = item;
      }
    }
    std::copy(moved, right, left);
  }
  template <class IsLeft>
  void PartitionTogether(const Range& range, const IsLeft& is_left) {
    struct Place {
      int32_t left = 0, right = 0;
    };
    std::vector<Place> of_part(MostParts(range) + 1);  // how many, then where the first ones go
    const size_t count = ForParts(range, [&](size_t part, const Range& own) {
      for (int32_t i = own.begin; i < own.end; ++i) {
        ++(is_left(items_[static_cast<size_t>(i)]) ? of_part[part].left : of_part[part].right);
      }
    });
    Place next{range.begin, range.begin};
    for (size_t part = 0; part < count; ++part) next.right += of_part[part].left;
    for (size_t part = 0; part < count; ++part) {
      const Place own = std::exchange(of_part[part], next);
      next.left += own.left, next.right += own.right;
    }
    ForParts(range, [&](size_t part, const Range& own) {
      poll_.Now();
      Place place = of_part[part];
      for (int32_t i = own.begin; i < own.end; ++i) {
        const Item& item = items_[static_cast<size_t>(i)];
        moved_[static_cast<size_t>(is_left(item) ? place.left++ : place.right++)] = item;
      }
    });
    ForParts(range, [&](size_t, const Range& own) {
      std::copy(moved_.begin() + own.begin, moved_.begin() + own.end, items_.begin() + own.begin);
    });
  }

  const StopPoll poll_;
  std::vector<Item> items_;
  std::vector<Item> moved_;  // each range's own
};

// What dipoles ask of a triangle at every level, found once where it does not take much memory.
constexpr size_t kMostKept = 1 << 20;
struct DipoleTerms {
  Vec3d area_normal, weighted;
  double area = 0;
  Vec3d middle;
};

class DipoleBuilder {
 public:
  DipoleBuilder(const HullArrays& arrays, const StopPoll& poll) : arrays_(arrays), poll_(poll) {
    if (arrays.triangles.size() > kMostKept) return;
    std::vector<DipoleTerms> kept(arrays.triangles.size());
    ForAllPolling(kept.size(), kItemsPerBlock, poll, [&](size_t i) { kept[i] = TermsOf(i); });
    kept_ = std::move(kept);
  }

  HullDipole At(size_t id) const {
    const HullNode& node = arrays_.nodes[id];
    DipoleSums sums;
    ForParts(node, [&](int32_t begin, int32_t end) { sums.Add(SumsOf(begin, end)); });
    HullDipole dipole = sums.Dipole(node);
    DipoleMoments moments;
    ForParts(node, [&](int32_t begin, int32_t end) {
      moments.Add(MomentsOf(begin, end, dipole.centre));
    });
    moments.PutInto(dipole);
    return dipole;
  }

 private:
  template <class Visit>
  void ForParts(const HullNode& node, const Visit& visit) const {
    for (int32_t part = node.begin; part < node.end; part += kTrianglesPerSum) {
      if (part > node.begin) poll_.Now();
      visit(part, std::min(part + kTrianglesPerSum, node.end));
    }
  }
  DipoleTerms TermsOf(size_t i) const {
    if (!kept_.empty()) return kept_[i];
    const HullTriangle& t = arrays_.triangles[i];
    const DipoleSums sums = DipoleSums::Of(&t, &t + 1);
    return {sums.area_normal, sums.weighted, sums.area, (t.a + t.b + t.c) / 3.0};
  }
  // As DipoleSums::Of.
  DipoleSums SumsOf(int32_t begin, int32_t end) const {
    DipoleSums sums;
    for (int32_t i = begin; i < end; ++i) {
      const DipoleTerms terms = TermsOf(static_cast<size_t>(i));
      sums.Add({terms.area_normal, terms.weighted, terms.area});
    }
    return sums;
  }

  // As DipoleMoments::Of.
  DipoleMoments MomentsOf(int32_t begin, int32_t end, const Vec3d& centre) const {
    DipoleMoments m;
    for (int32_t i = begin; i < end; ++i) {
      const DipoleTerms terms = TermsOf(static_cast<size_t>(i));
      m.Add(terms.area_normal, terms.middle - centre);
      m.Reach(arrays_.triangles[static_cast<size_t>(i)], centre);
    }
    return m;
  }

  const HullArrays& arrays_;
  const StopPoll& poll_;
  std::vector<DipoleTerms> kept_;  // of all triangles, or none
};

std::vector<Item> ItemsOf(const std::vector<Vec3d>& vertices,
                          const std::vector<std::array<int32_t, 3>>& triangles,
                          const StopPoll& poll) {
  std::vector<Item> items(triangles.size());
  ForAllPolling(triangles.size(), kItemsPerBlock, poll, [&](size_t i) {
    const HullTriangle t = TriangleAt(vertices, triangles[i]);
    if (IsDegenerate(t.a, t.b, t.c)) {
      items[i].original = -1;
      return;
    }
    for (const Vec3d& p : {t.a, t.b, t.c}) items[i].box.ExtendTo({p.x, p.y, p.z});
    items[i].original = static_cast<int32_t>(i);
  });
  std::erase_if(items, [](const Item& item) { return item.original < 0; });
  return items;
}

void BuildNodes(const std::vector<Vec3d>& vertices,
                const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll,
                HullArrays& arrays) {
  TreeBuilder builder(ItemsOf(vertices, triangles, poll), poll);
  arrays.nodes = builder.Run();
  arrays.original.reserve(builder.items().size());
  for (const Item& item : builder.items()) arrays.original.push_back(item.original);
}

}  // namespace

void TakeTriangles(const std::vector<Vec3d>& vertices,
                   const std::vector<std::array<int32_t, 3>>& triangles, HullArrays* arrays) {
  const size_t count = arrays->original.size();
  arrays->triangles.resize(count), arrays->normals.resize(count);
  ForAllPolling(count, kItemsPerBlock, {}, [&](size_t i) {
    const HullTriangle t =
        TriangleAt(vertices, triangles[static_cast<size_t>(arrays->original[i])]);
    arrays->triangles[i] = t;
    arrays->normals[i] = Normalized(DoubleAreaVector(t.a, t.b, t.c));
  });
}

HullArrays BuildHullTree(const std::vector<Vec3d>& vertices,
                         const std::vector<std::array<int32_t, 3>>& triangles,
                         HullQuestions questions, const StopPoll& poll) {
  HullArrays arrays;
  BuildNodes(vertices, triangles, poll, arrays);
  TakeTriangles(vertices, triangles, &arrays);
  if (questions == HullQuestions::kDistances) return arrays;
  arrays.is_closed = arrays.triangles.size() == triangles.size() && EdgesBalance(triangles, poll);
  const DipoleBuilder dipoles(arrays, poll);
  arrays.dipoles.resize(arrays.nodes.size());
  ForAllPolling(arrays.nodes.size(), kNodesPerBlock, poll,
                [&](size_t node) { arrays.dipoles[node] = dipoles.At(node); });
  return arrays;
}

}  // namespace amhex
