#include "input/hull_queries.h"

#include <tbb/task_arena.h>

#include <utility>

#include "base/status_error.h"
#include "cuda/device_use.h"
#include "input/edges_balance.h"
#include "input/pack_hull.h"

namespace amhex {
namespace {

// On a device fewer triangles cost more than they save (a guess: some hundred launches of some
// microseconds, against half a microsecond per triangle here).
constexpr size_t kFewestForDevice = 2048;

}  // namespace

HullQueries::HullQueries(const std::vector<Vec3d>& vertices,
                         const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll,
                         DeviceUse* device, HullAskers askers, HullQuestions questions) {
  if (device != nullptr && triangles.size() >= kFewestForDevice) {
    BuildWhereChosen(vertices, triangles, poll, *device, askers, questions);
  } else {
    arrays_ = BuildHullTree(vertices, triangles, questions, poll);
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
                                   const StopPoll& poll, DeviceUse& device, HullAskers askers,
                                   HullQuestions questions) {
  HullTreeTask task;
  task.vertices = {vertices.data(), static_cast<int64_t>(vertices.size())};
  task.triangles = {triangles.data(), static_cast<int64_t>(triangles.size())};
  task.edges_balance = EdgesBalance(triangles, poll);
  task.resident = &resident_;
  if (askers == HullAskers::kHost) task.copy = &arrays_;
  task.should_stop = [&poll] { return poll.IsToStop(); };
  bool is_built_here = false;
  const absl::StatusOr<bool> is_done = device.Run(&task, [&] {
    is_built_here = true;
    arrays_ = BuildHullTree(vertices, triangles, questions, poll);
    return true;
  });
  if (!is_done.ok()) throw StatusError(is_done.status());
  if (is_built_here) return;
  if (!*is_done) throw RunStopped();
  is_here_ = askers == HullAskers::kHost;
  if (is_here()) {
    TakeTriangles(vertices, triangles, &arrays_);
  } else {
    source_ = {vertices, triangles};
  }
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
  tbb::this_task_arena::isolate(
      [this] { TakeTriangles(source_.vertices, source_.triangles, &arrays_); });
  source_ = {};
  TakeView({});
  is_here_.store(true, std::memory_order_release);
}

const HullView& HullQueries::view_with_sides() const {
  const HullView& all = view();
  if (all.dipoles.size < all.nodes.size) {
    throw StatusError(absl::InternalError("sides are asked of a hierarchy built for distances"));
  }
  return all;
}

double HullQueries::SignedDistance(const Vec3d& p) const {
  const double distance = Closest(p).distance;
  return IsInside(p) ? -distance : distance;
}

}  // namespace amhex
