#include "input/point_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

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

// The smallest range of the tree that p falls into and that holds at least `count` points.
std::pair<int32_t, int32_t> PointTree::RangeAround(const Vec3d& p, int32_t count) const {
  int32_t begin = 0, end = static_cast<int32_t>(points_.size());
  while (end - begin > kLeafPoints) {
    const int32_t middle = MiddleOf(begin, end);
    const int axis = axis_[static_cast<size_t>(middle)];
    const bool is_left = p[axis] <= points_[static_cast<size_t>(middle)][axis];
    const int32_t next_begin = is_left ? begin : middle + 1, next_end = is_left ? middle : end;
    if (next_end - next_begin < count) break;
    begin = next_begin, end = next_end;
  }
  return {begin, end};
}

void PointTree::Nearest(const Vec3d& p, int count, std::vector<Neighbour>& result) const {
  result.clear();
  if (count <= 0 || points_.empty()) return;
  const auto visit = [&](int32_t i) {
    result.push_back(
        {SquaredNorm(points_[static_cast<size_t>(i)] - p), index_[static_cast<size_t>(i)]});
  };
  const auto [begin, end] = RangeAround(p, count);
  for (int32_t i = begin; i < end; ++i) visit(i);
  const auto wanted = std::min(static_cast<size_t>(count), result.size());
  const auto last = result.begin() + static_cast<std::ptrdiff_t>(wanted) - 1;
  std::nth_element(result.begin(), last, result.end());
  if (end - begin < static_cast<int32_t>(points_.size())) {
    // Points around p bound the distance: what is within is collected and sorted once, for less
    // than it takes to keep the best so far in order all the time.
    const double limit = last->squared_distance;
    result.clear();
    const auto visit_near = [&](int32_t i) {
      const double squared = SquaredNorm(points_[static_cast<size_t>(i)] - p);
      if (squared <= limit) result.push_back({squared, index_[static_cast<size_t>(i)]});
    };
    Search(p, visit_near, [&] { return limit; });
    std::nth_element(result.begin(), result.begin() + static_cast<std::ptrdiff_t>(wanted) - 1,
                     result.end());
  }
  result.resize(wanted);
  std::sort(result.begin(), result.end());
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
