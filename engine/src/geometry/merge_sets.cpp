#include "geometry/merge_sets.h"

#include <algorithm>
#include <numeric>

namespace amhex {
namespace {

// A set wider than this many mean cell sizes would pull its cubes out of shape.
constexpr double kMaxSetSpan = 1.3;

bool IsCubeEdge(int corner_a, int corner_b) {
  for (const auto& edge : kCubeEdges) {
    if ((edge[0] == corner_a && edge[1] == corner_b) ||
        (edge[0] == corner_b && edge[1] == corner_a)) {
      return true;
    }
  }
  return false;
}

}  // namespace

MergeSets::MergeSets(const Cubes& cubes) : cubes_(cubes) {
  const int count = 8 * cubes.count();
  parent_.resize(count);
  std::iota(parent_.begin(), parent_.end(), 0);
  ring_next_ = parent_;
  size_.assign(count, 1);
  box_.resize(count);
  for (int v = 0; v < count; ++v) {
    const Vec3d p = cubes.VirtualVertex(v);
    box_[v] = {p, p};
  }
}

int MergeSets::Find(int v) const {
  while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
  return v;
}

bool MergeSets::GroupIsAllowed(const std::vector<int>& roots, Collapse collapse) const {
  std::vector<int> members;
  Vec3d low = box_[roots[0]].low, high = box_[roots[0]].high;
  for (const int root : roots) {
    low = ComponentMin(low, box_[root].low);
    high = ComponentMax(high, box_[root].high);
    int v = root;
    do {
      members.push_back(v);
      v = ring_next_[v];
    } while (v != root);
  }
  double mean_size = 0;
  for (const int v : members) mean_size += 2 * cubes_.mean_half[v / 8];
  mean_size /= static_cast<double>(members.size());
  const Vec3d extent = high - low;
  if (std::max({extent.x, extent.y, extent.z}) > kMaxSetSpan * mean_size) return false;

  std::sort(members.begin(), members.end());
  for (size_t a = 0; a + 1 < members.size(); ++a) {
    for (size_t b = a + 1; b < members.size() && members[b] / 8 == members[a] / 8; ++b) {
      if (collapse == Collapse::kForbidden) return false;
      if (!IsCubeEdge(members[a] % 8, members[b] % 8)) return false;
    }
  }
  return true;
}

bool MergeSets::CanMerge(const CornerPairs& pairs, Collapse collapse) const {
  // The four pairs may join the same sets; find the groups they would form together.
  std::array<int, 8> root{};
  std::array<int, 8> group{};
  int count = 0;
  const auto slot = [&](int r) {
    for (int i = 0; i < count; ++i) {
      if (root[i] == r) return i;
    }
    root[count] = r;
    group[count] = count;
    return count++;
  };
  for (const auto& [a, b] : pairs) {
    const int ga = group[slot(Find(a))];
    const int gb = group[slot(Find(b))];
    for (int i = 0; i < count; ++i) {
      if (group[i] == gb) group[i] = ga;
    }
  }
  std::vector<int> members;
  for (int g = 0; g < count; ++g) {
    members.clear();
    for (int i = 0; i < count; ++i) {
      if (group[i] == g) members.push_back(root[i]);
    }
    if (members.size() > 1 && !GroupIsAllowed(members, collapse)) return false;
  }
  return true;
}

void MergeSets::Merge(const CornerPairs& pairs) {
  for (const auto& [a, b] : pairs) Unite(a, b);
}

void MergeSets::Unite(int a, int b) {
  a = Find(a);
  b = Find(b);
  if (a == b) return;
  if (size_[a] < size_[b] || (size_[a] == size_[b] && b < a)) std::swap(a, b);
  parent_[b] = a;
  size_[a] += size_[b];
  std::swap(ring_next_[a], ring_next_[b]);
  box_[a].low = ComponentMin(box_[a].low, box_[b].low);
  box_[a].high = ComponentMax(box_[a].high, box_[b].high);
}

}  // namespace amhex
