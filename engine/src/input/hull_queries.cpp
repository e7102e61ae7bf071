#include "input/hull_queries.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "input/triangle_math.h"

namespace amhex {
namespace {

constexpr int32_t kLeafTriangles = 4;
constexpr int kBinCount = 16;
// Subtrees of more triangles than this are built by a task of their own.
constexpr int32_t kTrianglesPerTask = 16384;
// Barill et al. 2018: a node is far beyond this many of its radii.
constexpr double kFarRatio = 2.3;

double HalfArea(const Box3d& box) {
  if (box.IsEmpty()) return 0;
  const Vec3d e = box.Extent();
  return e.x * e.y + e.y * e.z + e.z * e.x;
}

// Where the ray enters the box, or a value above `limit` if it misses it.
double EntryDistance(const Vec3d& origin, const Vec3d& inverse, const Vec3d& low, const Vec3d& high,
                     double limit) {
  double enter = 0, leave = limit;
  for (int axis = 0; axis < 3; ++axis) {
    const double t0 = (low[axis] - origin[axis]) * inverse[axis];
    const double t1 = (high[axis] - origin[axis]) * inverse[axis];
    // Comparisons with not-a-number (a zero direction inside the slab) leave the range as it is.
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return enter <= leave ? enter : 2 * limit;
}

}  // namespace

HullQueries::HullQueries(const std::vector<Vec3d>& vertices,
                         const std::vector<std::array<int32_t, 3>>& triangles,
                         const StopPoll& poll) {
  triangles_.reserve(triangles.size());
  original_.reserve(triangles.size());
  for (size_t i = 0; i < triangles.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    const auto& t = triangles[i];
    const Triangle triangle{vertices[static_cast<size_t>(t[0])],
                            vertices[static_cast<size_t>(t[1])],
                            vertices[static_cast<size_t>(t[2])]};
    if (IsDegenerate(triangle.a, triangle.b, triangle.c)) continue;
    triangles_.push_back(triangle);
    original_.push_back(static_cast<int32_t>(i));
  }
  if (!triangles_.empty()) {
    nodes_.reserve(triangles_.size());
    Build({0, static_cast<int32_t>(triangles_.size())}, 0, poll, &nodes_);
  }

  normals_.reserve(triangles_.size());
  for (const Triangle& t : triangles_) {
    poll.At(static_cast<int64_t>(normals_.size()));
    normals_.push_back(Normalized(DoubleAreaVector(t.a, t.b, t.c)));
  }
  dipoles_.resize(nodes_.size());
  tbb::parallel_for(size_t{0}, nodes_.size(),
                    [&](size_t node) { ComputeDipole(static_cast<int32_t>(node), poll); });
  const auto view = [](const auto& values) {
    return ArrayView{values.data(), static_cast<int64_t>(values.size())};
  };
  view_ = {view(triangles_), view(normals_), view(original_), view(nodes_), view(dipoles_)};
}

void HullQueries::Build(const Range& range, int depth, const StopPoll& poll,
                        std::vector<Node>* nodes) {
  const int32_t begin = range.begin, end = range.end;
  Box3d box;
  for (int32_t i = begin; i < end; ++i) {
    const Triangle& t = triangles_[static_cast<size_t>(i)];
    box.Extend(t.a), box.Extend(t.b), box.Extend(t.c);
  }
  const size_t id = nodes->size();
  nodes->push_back({box.low, box.high, begin, end, -1});
  if (end - begin <= kLeafTriangles) return;

  const int32_t middle = Split(range, depth, poll);
  std::vector<Node> right_subtree;
  const bool is_large = end - begin > kTrianglesPerTask;
  const auto build_left = [&] { Build({begin, middle}, depth + 1, poll, nodes); };
  const auto build_right = [&] { Build({middle, end}, depth + 1, poll, &right_subtree); };
  if (is_large) tbb::parallel_invoke(build_left, build_right);
  if (!is_large) build_left();
  const auto right = static_cast<int32_t>(nodes->size());
  (*nodes)[id].right = right;
  if (!is_large) return Build({middle, end}, depth + 1, poll, nodes);
  for (Node& node : right_subtree) {
    if (node.right >= 0) node.right += right;
  }
  nodes->insert(nodes->end(), right_subtree.begin(), right_subtree.end());
}

// Reorders [begin, end) and returns where its right part starts: the binned surface area
// heuristic, by halves where that finds no split.
int32_t HullQueries::Split(const Range& range, int depth, const StopPoll& poll) {
  const int32_t begin = range.begin, end = range.end;
  const auto centre = [this](int32_t i) {
    const Triangle& t = triangles_[static_cast<size_t>(i)];
    return ComponentMin(ComponentMin(t.a, t.b), t.c) + ComponentMax(ComponentMax(t.a, t.b), t.c);
  };
  Box3d centres;
  for (int32_t i = begin; i < end; ++i) {
    poll.At(i);
    centres.Extend(centre(i));
  }
  const Vec3d extent = centres.Extent();
  const int axis =
      extent.x >= extent.y ? (extent.x >= extent.z ? 0 : 2) : (extent.y >= extent.z ? 1 : 2);
  const int32_t half = begin + (end - begin) / 2;
  if (!(extent[axis] > 0)) return half;

  const double to_bin = kBinCount / extent[axis];
  const auto bin_of = [&](int32_t i) {
    const int bin = static_cast<int>((centre(i)[axis] - centres.low[axis]) * to_bin);
    return std::clamp(bin, 0, kBinCount - 1);
  };
  std::array<Box3d, kBinCount> boxes;
  std::array<int32_t, kBinCount> counts{};
  for (int32_t i = begin; i < end; ++i) {
    poll.At(i);
    const auto bin = static_cast<size_t>(bin_of(i));
    const Triangle& t = triangles_[static_cast<size_t>(i)];
    boxes[bin].Extend(t.a), boxes[bin].Extend(t.b), boxes[bin].Extend(t.c);
    ++counts[bin];
  }
  std::array<double, kBinCount> right_cost{};
  Box3d right_box;
  int32_t right_count = 0;
  for (size_t bin = kBinCount - 1; bin > 0; --bin) {
    right_box.low = ComponentMin(right_box.low, boxes[bin].low);
    right_box.high = ComponentMax(right_box.high, boxes[bin].high);
    right_count += counts[bin];
    right_cost[bin] = right_count * HalfArea(right_box);
  }
  Box3d left_box;
  int32_t left_count = 0;
  double best_cost = 1e300;
  int best_bin = -1;
  for (int bin = 1; bin < kBinCount; ++bin) {
    const auto last = static_cast<size_t>(bin - 1);
    left_box.low = ComponentMin(left_box.low, boxes[last].low);
    left_box.high = ComponentMax(left_box.high, boxes[last].high);
    left_count += counts[last];
    if (left_count == 0 || left_count == end - begin) continue;
    const double cost = left_count * HalfArea(left_box) + right_cost[static_cast<size_t>(bin)];
    if (cost < best_cost) best_cost = cost, best_bin = bin;
  }
  if (best_bin >= 0 && depth < kHullBalancedDepth) {
    return Reorder(range, poll, [&](std::vector<int32_t>& order) {
      return std::stable_partition(order.begin(), order.end(),
                                   [&](int32_t i) { return bin_of(i) < best_bin; });
    });
  }
  return Reorder(range, poll, [&](std::vector<int32_t>& order) {
    std::stable_sort(order.begin(), order.end(),
                     [&](int32_t i, int32_t j) { return centre(i)[axis] < centre(j)[axis]; });
    return order.begin() + (half - begin);
  });
}

// Both arrays move together. `rearrange` orders the triangles' numbers and returns the first of the
// right part; it is stable, so that the hierarchy is reproducible.
template <class Rearrange>
int32_t HullQueries::Reorder(const Range& range, const StopPoll& poll, const Rearrange& rearrange) {
  std::vector<int32_t> order(static_cast<size_t>(range.end - range.begin));
  std::iota(order.begin(), order.end(), range.begin);
  const auto middle = rearrange(order);
  std::vector<Triangle> moved;
  std::vector<int32_t> moved_ids;
  moved.reserve(order.size()), moved_ids.reserve(order.size());
  for (const int32_t i : order) {
    poll.At(i);
    moved.push_back(triangles_[static_cast<size_t>(i)]);
    moved_ids.push_back(original_[static_cast<size_t>(i)]);
  }
  std::copy(moved.begin(), moved.end(), triangles_.begin() + range.begin);
  std::copy(moved_ids.begin(), moved_ids.end(), original_.begin() + range.begin);
  return range.begin + static_cast<int32_t>(middle - order.begin());
}

void HullQueries::ComputeDipole(int32_t id, const StopPoll& poll) {
  const Node& node = nodes_[static_cast<size_t>(id)];
  Dipole& dipole = dipoles_[static_cast<size_t>(id)];
  double area_sum = 0;
  Vec3d weighted;
  for (int32_t i = node.begin; i < node.end; ++i) {
    poll.At(i);
    const Triangle& t = triangles_[static_cast<size_t>(i)];
    const Vec3d area_vector = DoubleAreaVector(t.a, t.b, t.c) / 2.0;
    const double area = Norm(area_vector);
    dipole.area_normal += area_vector;
    weighted += (t.a + t.b + t.c) * (area / 3);
    area_sum += area;
  }
  dipole.centre = area_sum > 0 ? weighted / area_sum : (node.low + node.high) / 2.0;
  for (int32_t i = node.begin; i < node.end; ++i) {
    const Triangle& t = triangles_[static_cast<size_t>(i)];
    poll.At(i);
    const Vec3d a = DoubleAreaVector(t.a, t.b, t.c) / 2.0;
    const Vec3d d = (t.a + t.b + t.c) / 3.0 - dipole.centre;
    dipole.xx += d.x * a.x, dipole.yy += d.y * a.y, dipole.zz += d.z * a.z;
    dipole.xy += (d.x * a.y + d.y * a.x) / 2;
    dipole.yz += (d.y * a.z + d.z * a.y) / 2;
    dipole.zx += (d.z * a.x + d.x * a.z) / 2;
  }
  double radius_squared = 0;
  for (int32_t i = node.begin; i < node.end; ++i) {
    const Triangle& t = triangles_[static_cast<size_t>(i)];
    for (const Vec3d& corner : {t.a, t.b, t.c}) {
      radius_squared = std::max(radius_squared, SquaredNorm(corner - dipole.centre));
    }
  }
  dipole.far_squared = kFarRatio * kFarRatio * radius_squared;
}

double HullQueries::SignedDistance(const Vec3d& p) const {
  const double distance = Closest(p).distance;
  return IsInside(p) ? -distance : distance;
}

double HullQueries::ExitDistance(const Vec3d& origin, const Vec3d& direction,
                                 double min_length) const {
  if (nodes_.empty()) return -1;
  constexpr double kFar = 1e300;
  const Vec3d inverse{1 / direction.x, 1 / direction.y, 1 / direction.z};
  std::array<int32_t, kHullStackSize> stack;
  int size = 1;
  stack[0] = 0;
  double best = kFar;
  while (size > 0) {
    const int32_t id = stack[static_cast<size_t>(--size)];
    const Node& node = nodes_[static_cast<size_t>(id)];
    if (EntryDistance(origin, inverse, node.low, node.high, best) > best) continue;
    if (node.right >= 0) {
      stack[static_cast<size_t>(size++)] = node.right;
      stack[static_cast<size_t>(size++)] = id + 1;
      continue;
    }
    for (int32_t i = node.begin; i < node.end; ++i) {
      const Triangle& t = triangles_[static_cast<size_t>(i)];
      const Vec3d area = DoubleAreaVector(t.a, t.b, t.c);
      const double facing = Dot(area, direction);
      if (!(facing > 0)) continue;
      const double length = Dot(area, t.a - origin) / facing;
      if (length < min_length || length >= best) continue;
      const Vec3d q = origin + direction * length;
      if (Dot(area, Cross(t.b - t.a, q - t.a)) >= 0 && Dot(area, Cross(t.c - t.b, q - t.b)) >= 0 &&
          Dot(area, Cross(t.a - t.c, q - t.c)) >= 0) {
        best = length;
      }
    }
  }
  return best < kFar ? best : -1;
}

}  // namespace amhex
