#include "input/hull_queries.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/status_error.h"
#include "cuda/device_use.h"
#include "input/hull_split.h"
#include "input/pack_hull.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

// Subtrees of more triangles than this are built by a task of their own.
constexpr int32_t kTrianglesPerTask = 16384;
// On a device fewer triangles cost more than they save (a guess: some hundred launches of some
// microseconds, against half a microsecond per triangle here).
constexpr size_t kFewestForDevice = 2048;

}  // namespace

HullQueries::HullQueries(const std::vector<Vec3d>& vertices,
                         const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll,
                         DeviceUse* device, HullAskers askers) {
  if (device != nullptr && triangles.size() >= kFewestForDevice) {
    BuildWhereChosen(vertices, triangles, poll, *device, askers);
  } else {
    BuildHere(vertices, triangles, poll);
  }
  TakeView(poll);
}

void HullQueries::TakeView(const StopPoll& poll) const {
  view_ = arrays_.View();
  if (view_.nodes.empty()) return;
  packets_ = PackHull(view_, poll);
  view_.packets = {packets_.data(), static_cast<int64_t>(packets_.size())};
}

void HullQueries::BuildWhereChosen(const std::vector<Vec3d>& vertices,
                                   const std::vector<std::array<int32_t, 3>>& triangles,
                                   const StopPoll& poll, DeviceUse& device, HullAskers askers) {
  HullTreeTask task;
  task.vertices = {vertices.data(), static_cast<int64_t>(vertices.size())};
  task.triangles = {triangles.data(), static_cast<int64_t>(triangles.size())};
  task.resident = &resident_;
  if (askers == HullAskers::kHost) task.copy = &arrays_;
  task.should_stop = [&poll] { return poll.IsToStop(); };
  bool is_built_here = false;
  const absl::StatusOr<bool> is_done = device.Run(&task, [&] {
    is_built_here = true;
    BuildHere(vertices, triangles, poll);
    return true;
  });
  if (!is_done.ok()) throw StatusError(is_done.status());
  if (is_built_here) return;
  if (!*is_done) throw RunStopped();
  is_here_ = askers == HullAskers::kHost;
  if (is_here()) {
    TakeTriangles(vertices, triangles);
  } else {
    source_ = {vertices, triangles};
  }
}

void HullQueries::TakeTriangles(const std::vector<Vec3d>& vertices,
                                const std::vector<std::array<int32_t, 3>>& triangles) const {
  const size_t count = arrays_.original.size();
  arrays_.triangles.resize(count), arrays_.normals.resize(count);
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    const auto& t = triangles[static_cast<size_t>(arrays_.original[i])];
    const Triangle triangle{vertices[static_cast<size_t>(t[0])],
                            vertices[static_cast<size_t>(t[1])],
                            vertices[static_cast<size_t>(t[2])]};
    arrays_.triangles[i] = triangle;
    arrays_.normals[i] = Normalized(DoubleAreaVector(triangle.a, triangle.b, triangle.c));
  });
}

void HullQueries::Fetch() const {
  const std::lock_guard<std::mutex> lock(fetching_);
  if (is_here()) return;
  HullFetchTask task{&resident_, {}};
  const absl::StatusOr<bool> is_done = RunOnCuda(&task);
  if (!is_done.ok()) throw StatusError(is_done.status());
  arrays_ = std::move(task.copy);
  // While it holds the lock this thread must not take up a task of whoever asks: that one may ask
  // for the same.
  tbb::this_task_arena::isolate([this] { TakeTriangles(source_.vertices, source_.triangles); });
  source_ = {};
  TakeView({});
  is_here_.store(true, std::memory_order_release);
}

void HullQueries::BuildHere(const std::vector<Vec3d>& vertices,
                            const std::vector<std::array<int32_t, 3>>& triangles,
                            const StopPoll& poll) {
  arrays_.triangles.reserve(triangles.size());
  arrays_.original.reserve(triangles.size());
  for (size_t i = 0; i < triangles.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    const auto& t = triangles[i];
    const Triangle triangle{vertices[static_cast<size_t>(t[0])],
                            vertices[static_cast<size_t>(t[1])],
                            vertices[static_cast<size_t>(t[2])]};
    if (IsDegenerate(triangle.a, triangle.b, triangle.c)) continue;
    arrays_.triangles.push_back(triangle);
    arrays_.original.push_back(static_cast<int32_t>(i));
  }
  if (!arrays_.triangles.empty()) {
    arrays_.nodes.reserve(arrays_.triangles.size());
    Build({0, static_cast<int32_t>(arrays_.triangles.size())}, 0, poll, &arrays_.nodes);
  }

  arrays_.normals.reserve(arrays_.triangles.size());
  for (const Triangle& t : arrays_.triangles) {
    poll.At(static_cast<int64_t>(arrays_.normals.size()));
    arrays_.normals.push_back(Normalized(DoubleAreaVector(t.a, t.b, t.c)));
  }
  arrays_.dipoles.resize(arrays_.nodes.size());
  tbb::parallel_for(size_t{0}, arrays_.nodes.size(),
                    [&](size_t node) { ComputeDipole(static_cast<int32_t>(node), poll); });
}

void HullQueries::Build(const Range& range, int depth, const StopPoll& poll,
                        std::vector<Node>* nodes) {
  const int32_t begin = range.begin, end = range.end;
  Box3d box;
  for (int32_t i = begin; i < end; ++i) {
    const Triangle& t = arrays_.triangles[static_cast<size_t>(i)];
    box.Extend(t.a), box.Extend(t.b), box.Extend(t.c);
  }
  const size_t id = nodes->size();
  nodes->push_back({box.low, box.high, begin, end, -1});
  if (end - begin <= kHullLeafTriangles) return;

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
  const auto triangle = [this](int32_t i) -> const Triangle& {
    return arrays_.triangles[static_cast<size_t>(i)];
  };
  HullBox centres;
  for (int32_t i = begin; i < end; ++i) {
    poll.At(i);
    centres.Extend(BoxCentre(triangle(i)));
  }
  const HullBins bins = HullBins::Over(centres);
  const int32_t half = begin + (end - begin) / 2;
  if (!bins.CanSplit()) return half;

  std::array<HullBin, kHullBinCount> filled;
  for (int32_t i = begin; i < end; ++i) {
    poll.At(i);
    HullBin& bin = filled[static_cast<size_t>(bins.BinOf(triangle(i)))];
    bin.box.Extend(triangle(i));
    ++bin.count;
  }
  const int best_bin =
      BestBin(end - begin, [&](int bin) { return filled[static_cast<size_t>(bin)]; });
  if (best_bin >= 0 && depth < kHullBalancedDepth) {
    return Reorder(range, poll, [&](std::vector<int32_t>& order) {
      return std::stable_partition(order.begin(), order.end(),
                                   [&](int32_t i) { return bins.BinOf(triangle(i)) < best_bin; });
    });
  }
  return Reorder(range, poll, [&](std::vector<int32_t>& order) {
    std::stable_sort(order.begin(), order.end(), [&](int32_t i, int32_t j) {
      return BoxCentre(triangle(i))[bins.axis] < BoxCentre(triangle(j))[bins.axis];
    });
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
    moved.push_back(arrays_.triangles[static_cast<size_t>(i)]);
    moved_ids.push_back(arrays_.original[static_cast<size_t>(i)]);
  }
  std::copy(moved.begin(), moved.end(), arrays_.triangles.begin() + range.begin);
  std::copy(moved_ids.begin(), moved_ids.end(), arrays_.original.begin() + range.begin);
  return range.begin + static_cast<int32_t>(middle - order.begin());
}

void HullQueries::ComputeDipole(int32_t id, const StopPoll& poll) {
  const Node& node = arrays_.nodes[static_cast<size_t>(id)];
  poll.At(id);
  const auto for_parts = [&](const auto& visit) {
    for (int32_t part = node.begin; part < node.end; part += kTrianglesPerSum) {
      if (part > node.begin) poll.Now();
      visit(&arrays_.triangles[static_cast<size_t>(part)],
            arrays_.triangles.data() + std::min(part + kTrianglesPerSum, node.end));
    }
  };
  DipoleSums sums;
  for_parts([&](const Triangle* begin, const Triangle* end) { sums.Add(sums.Of(begin, end)); });
  Dipole& dipole = arrays_.dipoles[static_cast<size_t>(id)];
  dipole = sums.Dipole(node);
  DipoleMoments moments;
  for_parts([&](const Triangle* begin, const Triangle* end) {
    moments.Add(moments.Of(begin, end, dipole.centre));
  });
  moments.PutInto(dipole);
}

double HullQueries::SignedDistance(const Vec3d& p) const {
  const double distance = Closest(p).distance;
  return IsInside(p) ? -distance : distance;
}

}  // namespace amhex
