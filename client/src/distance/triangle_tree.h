// The closest point on a set of triangles.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/input_hull.h"

namespace amhex::client {

class TriangleTree {
 public:
  struct Closest {
    double distance = 0;
    int32_t triangle = -1;
  };

  // Triangles may have no area, or cross each other. O(n log n).
  explicit TriangleTree(TriangleMesh mesh);

  // Of triangles at the same distance any one, the same for the same mesh. There must be a
  // triangle. O(log n) for points near well-shaped surfaces.
  Closest Find(const Vec3d& point) const;

 private:
  // Inner nodes have their children at `first` and `first + 1`, leaves `count` triangles from
  // `order_[first]` on.
  struct Node {
    Box3d box;
    int32_t first = 0;
    int32_t count = 0;
  };

  void Split(int32_t node, const std::vector<Vec3d>& centres);
  void FindInLeaf(const Node& leaf, const Vec3d& point, double* least, int32_t* triangle) const;

  TriangleMesh mesh_;
  std::vector<int32_t> order_;
  std::vector<Node> nodes_;
};

// The square of the distance from `p` to the triangle a b c, which may be a segment or a point.
double SquaredDistanceToTriangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c);

}  // namespace amhex::client
