#include "input/point_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace amhex {
namespace {

constexpr int32_t kLeafPoints = 8;
constexpr int kStackSize = 64;  // the tree is balanced: its depth is below 32

int32_t MiddleOf(int32_t begin, int32_t end) { return begin + (end - begin) / 2; }

}  // namespace

PointTree::PointTree(const std::vector<Vec3d>& points)
    : points_(points), index_(points.size()), axis_(points.size(), 0) {
  std::iota(index_.begin(), index_.end(), 0);
  Build(0, static_cast<int32_t>(points.size()));
  for (size_t i = 0; i < index_.size(); ++i) points_[i] = points[static_cast<size_t>(index_[i])];
}

// Orders index_ only; points_ still are in the caller's order.
void PointTree::Build(int32_t begin, int32_t end) {
  if (end - begin <= kLeafPoints) return;
  Box3d box;
  for (int32_t i = begin; i < end; ++i) {
    box.Extend(points_[static_cast<size_t>(index_[static_cast<size_t>(i)])]);
  }
  const Vec3d e = box.Extent();
  const int axis = e.x >= e.y ? (e.x >= e.z ? 0 : 2) : (e.y >= e.z ? 1 : 2);
  const int32_t middle = MiddleOf(begin, end);
  std::nth_element(index_.begin() + begin, index_.begin() + middle, index_.begin() + end,
                   [&](int32_t a, int32_t b) {
                     const double pa = points_[static_cast<size_t>(a)][axis];
                     const double pb = points_[static_cast<size_t>(b)][axis];
                     return pa != pb ? pa < pb : a < b;
                   });
  axis_[static_cast<size_t>(middle)] = static_cast<uint8_t>(axis);
  Build(begin, middle);
  Build(middle + 1, end);
}

template <class Visit, class Limit>
void PointTree::Search(const Vec3d& p, const Visit& visit, const Limit& limit) const {
  struct Range {
    int32_t begin, end;
    double squared;  // lower bound of the distance
  };
  std::array<Range, kStackSize> stack;
  int size = 1;
  stack[0] = {0, static_cast<int32_t>(points_.size()), 0};
  while (size > 0) {
    const Range range = stack[static_cast<size_t>(--size)];
    if (range.squared > limit()) continue;
    if (range.end - range.begin <= kLeafPoints) {
      for (int32_t i = range.begin; i < range.end; ++i) visit(i);
      continue;
    }
    const int32_t middle = MiddleOf(range.begin, range.end);
    const int axis = axis_[static_cast<size_t>(middle)];
    const double offset = p[axis] - points_[static_cast<size_t>(middle)][axis];
    visit(middle);
    Range near{range.begin, middle, range.squared};
    Range far{middle + 1, range.end, range.squared};
    if (offset > 0) std::swap(near, far);
    far.squared = std::max(range.squared, offset * offset);
    stack[static_cast<size_t>(size++)] = far;
    stack[static_cast<size_t>(size++)] = near;
  }
}

void PointTree::Nearest(const Vec3d& p, int count, std::vector<Neighbour>& result) const {
  result.clear();
  if (count <= 0) return;
  const auto wanted = static_cast<size_t>(count);
  // A max-heap of the best so far.
  const auto visit = [&](int32_t i) {
    const Neighbour candidate{SquaredNorm(points_[static_cast<size_t>(i)] - p),
                              index_[static_cast<size_t>(i)]};
    if (result.size() < wanted) {
      result.push_back(candidate);
      std::push_heap(result.begin(), result.end());
    } else if (candidate < result.front()) {
      std::pop_heap(result.begin(), result.end());
      result.back() = candidate;
      std::push_heap(result.begin(), result.end());
    }
  };
  Search(p, visit,
         [&] { return result.size() < wanted ? 1e300 : result.front().squared_distance; });
  std::sort_heap(result.begin(), result.end());
}

PointTree::Neighbour PointTree::Nearest(const Vec3d& p, double max_distance) const {
  Neighbour best{max_distance * max_distance, -1};
  const auto visit = [&](int32_t i) {
    const Neighbour candidate{SquaredNorm(points_[static_cast<size_t>(i)] - p),
                              index_[static_cast<size_t>(i)]};
    if (candidate.squared_distance > best.squared_distance) return;
    if (best.index < 0 || candidate < best) best = candidate;
  };
  Search(p, visit, [&] { return best.squared_distance; });
  return best;
}

void PointTree::Within(const Vec3d& p, double radius, std::vector<Neighbour>& result) const {
  result.clear();
  const double limit = radius * radius;
  const auto visit = [&](int32_t i) {
    const double squared = SquaredNorm(points_[static_cast<size_t>(i)] - p);
    if (squared <= limit) result.push_back({squared, index_[static_cast<size_t>(i)]});
  };
  Search(p, visit, [&] { return limit; });
  std::sort(result.begin(), result.end(),
            [](const Neighbour& a, const Neighbour& b) { return a.index < b.index; });
}

}  // namespace amhex
