// Closest points, winding numbers and rays on a triangle soup, by a bounding volume hierarchy.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "amhex/vec3.h"
#include "base/stop_poll.h"
#include "exec/resident_slot.h"
#include "input/build_hull_tree.h"
#include "input/hull.h"
#include "input/hull_tree_task.h"
#include "input/hull_view.h"

namespace amhex {

class DeviceUse;

// Who asks a hierarchy that is built on a device.
enum class HullAskers : uint8_t {
  kHost,    // the host, too: it gets a copy at once
  kDevice,  // the device, mostly: the host gets a copy when it asks
};

// Immutable after construction; all queries are const and safe from any number of threads. Only the
// copies come later, the device's or the host's, and go with this. Queries throw StatusError where
// the host's cannot be fetched.
class HullQueries {
 public:
  // Triangles without area (see IsDegenerate in triangle_math.h) are left out: their points lie on
  // their neighbours' edges. O(n log n); the same input always gives the same hierarchy, built on
  // `device` unless that is null. Throws RunStopped when `poll` does, StatusError when the device
  // fails.
  HullQueries(const std::vector<Vec3d>& vertices,
              const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll = {},
              DeviceUse* device = nullptr, HullAskers askers = HullAskers::kHost,
              HullQuestions questions = HullQuestions::kAll);
  // The same, built on the host, for these questions alone.
  HullQueries(const std::vector<Vec3d>& vertices,
              const std::vector<std::array<int32_t, 3>>& triangles, HullQuestions questions,
              const StopPoll& poll)
      : HullQueries(vertices, triangles, poll, nullptr, HullAskers::kHost, questions) {}
  HullQueries(const HullQueries&) = delete;
  HullQueries& operator=(const HullQueries&) = delete;

  // Closest point within `max_distance`; `triangle` is -1 if there is none. O(log n) expected.
  HullPoint Closest(const Vec3d& p, double max_distance = 1e300) const {
    return view().Closest(p, max_distance);
  }

  // Whether any triangle is within `distance`: cheaper than finding the closest.
  bool IsWithin(const Vec3d& p, double distance) const { return view().IsWithin(p, distance); }

  // The same for one point after the other, each near the last one or where it was before: `likely`
  // starts at -1 and remembers where the answer was found. The same answers, sooner.
  bool IsWithin(const Vec3d& p, double distance, int32_t& likely) const {
    return view().IsWithin(p, distance, likely);
  }
  HullPoint Closest(const Vec3d& p, int32_t& likely) const { return view().Closest(p, likely); }

  // Of a closed surface the whole number of times that it winds around a point, by the triangles
  // that a ray from there passes (crossing_ray.h). Of others, and where rounding leaves that open,
  // the generalised winding number (Barill et al. 2018): about 1 inside, 0 outside; exact near the
  // surface, dipoles far from it. O(log n) expected. Like all that tells sides, a StatusError where
  // the hierarchy was built for distances.
  double WindingNumber(const Vec3d& p) const { return view_with_sides().WindingNumber(p); }
  bool IsInside(const Vec3d& p) const { return WindingNumber(p) > 0.5; }

  // Negative inside. Sign by winding number, magnitude by closest point.
  double SignedDistance(const Vec3d& p) const;

  // Length of the ray from `origin` along the unit vector `direction` until it first meets a
  // triangle seen from behind (whose normal does not oppose the ray), at least `min_length` away;
  // a negative number if it meets none. From a point inside, that is where it leaves the hull.
  double ExitDistance(const Vec3d& origin, const Vec3d& direction, double min_length) const {
    return view().ExitDistance(origin, direction, min_length);
  }

  // The same queries where bodies run; must not outlive this.
  const HullView& view() const {
    if (!is_here_.load(std::memory_order_acquire)) Fetch();
    return view_;
  }
  // The same, for those who ask on which side points are.
  const HullView& view_with_sides() const;
  // Where the host has no copy, nothing: the device has one.
  HullView view_if_here() const { return is_here() ? view_ : HullView(); }
  bool is_here() const { return is_here_.load(std::memory_order_acquire); }
  // For the device's copy of that view.
  ResidentSlot& resident() const { return resident_; }

 private:
  void BuildWhereChosen(const std::vector<Vec3d>& vertices,
                        const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll,
                        DeviceUse& device, HullAskers askers, HullQuestions questions);
  void Fetch() const;
  // Of the arrays, once they are there.
  void TakeView(const StopPoll& poll) const;

  // What a copy will be made of; nothing once it has been.
  struct Source {
    std::vector<Vec3d> vertices;
    std::vector<std::array<int32_t, 3>> triangles;
  };
  mutable Source source_;
  mutable HullArrays arrays_;
  mutable std::vector<HullPacket> packets_;
  mutable HullView view_;  // of all of them
  mutable std::atomic<bool> is_here_{true};
  mutable std::mutex fetching_;
  mutable ResidentSlot resident_;
};

}  // namespace amhex
