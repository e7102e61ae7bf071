// Closest points and winding numbers on a triangle soup, by a bounding volume hierarchy.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "input/hull.h"

namespace amhex {

// Immutable after construction; all queries are const and safe from any number of threads.
class HullQueries {
 public:
  HullQueries(const std::vector<Vec3d>& vertices,
              const std::vector<std::array<int32_t, 3>>& triangles);

  // Closest point within `max_distance`; `triangle` is -1 if there is none. O(log n) expected.
  HullPoint Closest(const Vec3d& p, double max_distance = 1e300) const;

  // Generalised winding number (Barill et al. 2018): about 1 inside, 0 outside; exact near the
  // surface, dipoles far from it. O(log n) expected.
  double WindingNumber(const Vec3d& p) const;
  bool IsInside(const Vec3d& p) const { return WindingNumber(p) > 0.5; }

  // Negative inside. Sign by winding number, magnitude by closest point.
  double SignedDistance(const Vec3d& p) const;

 private:
  struct Node {
    Vec3d low, high;
    int32_t left = -1, right = -1;  // children; -1 on leaves
    int32_t begin = 0, end = 0;     // range of triangle_order_
    Vec3d dipole_centre, area_normal;
    double radius = 0;  // of the triangles around dipole_centre
  };
  int32_t Build(int32_t begin, int32_t end);

  std::vector<Vec3d> vertices_;
  std::vector<std::array<int32_t, 3>> triangles_;
  std::vector<Vec3d> normals_;
  std::vector<double> areas_;
  std::vector<int32_t> triangle_order_;
  std::vector<Node> nodes_;
};

}  // namespace amhex
