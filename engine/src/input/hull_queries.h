// Closest points, winding numbers and rays on a triangle soup, by a bounding volume hierarchy.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "base/stop_poll.h"
#include "exec/resident_slot.h"
#include "input/hull.h"
#include "input/hull_view.h"

namespace amhex {

class DeviceUse;

// Immutable after construction; all queries are const and safe from any number of threads. Only the
// device's copy comes later, and goes with this.
class HullQueries {
 public:
  // Triangles without area (see IsDegenerate in triangle_math.h) are left out: their points lie on
  // their neighbours' edges. O(n log n); the same input always gives the same hierarchy, built on
  // `device` unless that is null. Throws RunStopped when `poll` does, StatusError when the device
  // fails.
  HullQueries(const std::vector<Vec3d>& vertices,
              const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll = {},
              DeviceUse* device = nullptr);
  HullQueries(const HullQueries&) = delete;
  HullQueries& operator=(const HullQueries&) = delete;

  // Closest point within `max_distance`; `triangle` is -1 if there is none. O(log n) expected.
  HullPoint Closest(const Vec3d& p, double max_distance = 1e300) const {
    return view_.Closest(p, max_distance);
  }

  // Whether any triangle is within `distance`: cheaper than finding the closest.
  bool IsWithin(const Vec3d& p, double distance) const { return view_.IsWithin(p, distance); }

  // Generalised winding number (Barill et al. 2018): about 1 inside, 0 outside; exact near the
  // surface, dipoles far from it. O(log n) expected.
  double WindingNumber(const Vec3d& p) const { return view_.WindingNumber(p); }
  bool IsInside(const Vec3d& p) const { return WindingNumber(p) > 0.5; }

  // Negative inside. Sign by winding number, magnitude by closest point.
  double SignedDistance(const Vec3d& p) const;

  // Length of the ray from `origin` along the unit vector `direction` until it first meets a
  // triangle seen from behind (whose normal does not oppose the ray), at least `min_length` away;
  // a negative number if it meets none. From a point inside, that is where it leaves the hull.
  double ExitDistance(const Vec3d& origin, const Vec3d& direction, double min_length) const {
    return view_.ExitDistance(origin, direction, min_length);
  }

  // The same queries where bodies run; must not outlive this.
  const HullView& view() const { return view_; }
  // For the device's copy of that view.
  ResidentSlot& resident() const { return resident_; }

 private:
  using Node = HullNode;
  using Dipole = HullDipole;
  using Triangle = HullTriangle;

  struct Range {
    int32_t begin, end;
  };
  void BuildHere(const std::vector<Vec3d>& vertices,
                 const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll);
  void BuildWhereChosen(const std::vector<Vec3d>& vertices,
                        const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll,
                        DeviceUse& device);
  // Appends the subtree over a range of triangles_, its root first.
  void Build(const Range& range, int depth, const StopPoll& poll, std::vector<Node>* nodes);
  int32_t Split(const Range& range, int depth, const StopPoll& poll);
  template <class Rearrange>
  int32_t Reorder(const Range& range, const StopPoll& poll, const Rearrange& rearrange);
  void ComputeDipole(int32_t node, const StopPoll& poll);

  std::vector<Triangle> triangles_;  // in leaf order
  std::vector<Vec3d> normals_;       // unit, in leaf order
  std::vector<int32_t> original_;    // leaf order -> the caller's triangle index
  std::vector<Node> nodes_;
  std::vector<Dipole> dipoles_;  // per node
  HullView view_;                // of all of them
  mutable ResidentSlot resident_;
};

}  // namespace amhex
