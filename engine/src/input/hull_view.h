// The hierarchy behind the hull's queries as plain data, and the queries themselves: the same on
// the host and where bodies run. hull_queries.h builds and owns it.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/array_view.h"
#include "base/platform.h"
#include "input/crossing_ray.h"
#include "input/hull.h"
#include "input/hull_depth.h"
#include "input/triangle_math.h"

#if !defined(__CUDACC__)
#include "input/hull_packets.h"
#endif

namespace amhex {

struct HullPacket;

struct HullTriangle {
  Vec3d a, b, c;
};

// Depth-first order: the left child follows its parent.
struct HullNode {
  Vec3d low, high;
  int32_t begin = 0, end = 0;  // range of the triangles
  int32_t right = -1;          // right child; -1 on leaves
  int32_t unused = 0;          // no byte of a copy is undefined
};

// Far away, the triangles of a node act like one dipole and its first moment (Barill et al. 2018,
// equations 11 and 12).
struct HullDipole {
  Vec3d centre;
  Vec3d area_normal;  // sum of area times unit normal
  // Symmetric part of the sum of (triangle's centroid - centre) times area times unit normal.
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;
  double far_squared = 0;  // squared distance from `centre` beyond which the dipole is used
};

// The solid angle of a node's triangles from far away; r: from there to the dipole's centre, its
// square and its length. For one point or for several in lanes.
template <class Vector, class Number>
AMHEX_LANES_TOO Number FarSolidAngle(const HullDipole& dipole, const Vector& r,
                                     const Number& squared, const Number& length) {
  const Number along =
      dipole.xx * r.x * r.x + dipole.yy * r.y * r.y + dipole.zz * r.z * r.z +
      2.0 * (dipole.xy * r.x * r.y + dipole.yz * r.y * r.z + dipole.zx * r.z * r.x);
  const double trace = dipole.xx + dipole.yy + dipole.zz;
  const Vec3d& normal = dipole.area_normal;
  return (normal.x * r.x + normal.y * r.y + normal.z * r.z + trace - 3.0 * along / squared) /
         (squared * length);
}

// Views do not own: the arrays must outlive them. What each query means: hull_queries.h.
struct HullView {
  ArrayView<const HullTriangle> triangles;  // in leaf order, like the next two
  ArrayView<const Vec3d> normals;           // unit
  ArrayView<const int32_t> original;        // the caller's triangle index
  ArrayView<const HullNode> nodes;
  ArrayView<const HullDipole> dipoles;  // [node]
  // The same hierarchy for the host, which is asked first if it is there: the answers are the same
  // (hull_packets.h). It stays on the host.
  ArrayView<const HullPacket> packets;
  // Every edge is used as often one way as the other, and no triangle was left out.
  bool is_closed = false;

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(triangles), visit(normals), visit(original), visit(nodes), visit(dipoles);
  }

  AMHEX_HD HullPoint Closest(const Vec3d& p, double max_distance = 1e300) const {
    Nearest best;
    best.squared = max_distance < 1e150 ? max_distance * max_distance : 1e300;
    if (!nodes.empty()) Search(p, best);
    if (best.triangle < 0) return {};
    return {best.point, normals[best.triangle], original[best.triangle], std::sqrt(best.squared)};
  }

  AMHEX_HD bool IsWithin(const Vec3d& p, double distance) const {
    const double reach = distance * distance;
#if !defined(__CUDACC__)
    if (!packets.empty()) return IsWithinByPackets(p, reach);
#endif
    if (nodes.empty()) return false;
    const double slack = Slack();
    int32_t stack[kHullStackSize];
    int size = 1;
    stack[0] = 0;
    while (size > 0) {
      const int32_t id = stack[--size];
      const HullNode& node = nodes.data[id];
      if (SquaredDistanceTo(node, p, slack) > reach) continue;
      if (PushChildren(node, id, stack, size)) continue;
      for (int32_t i = node.begin; i < node.end; ++i) {
        if (SquaredNorm(NearestOn(i, p) - p) <= reach) return true;
      }
    }
    return false;
  }

#if !defined(__CUDACC__)
  // The same answers, sooner where triangle `likely` (in leaf order; < 0: none) is near. It becomes
  // the one that was found.
  bool IsWithin(const Vec3d& p, double distance, int32_t& likely) const {
    if (packets.empty()) return IsWithin(p, distance);
    const double reach = distance * distance;
    if (likely >= 0 && SquaredNorm(NearestOn(likely, p) - p) <= reach) return true;
    return IsWithinByPackets(p, reach, &likely);
  }
  HullPoint Closest(const Vec3d& p, int32_t& likely) const {
    Nearest best;
    best.squared = likely >= 0 ? SquaredNorm(NearestOn(likely, p) - p) : 1e300;
    if (!nodes.empty()) Search(p, best);
    if (best.triangle < 0) return {};
    likely = best.triangle;
    return {best.point, normals[best.triangle], original[best.triangle], std::sqrt(best.squared)};
  }
#endif

  AMHEX_HD double WindingNumber(const Vec3d& p) const {
    int32_t crossings = 0;
    return CountCrossings(p, crossings) ? crossings : WindingBySolidAngles(p);
  }

  // The winding number of a closed surface, or false: it is not closed, or `p` is on it, or almost,
  // or in line with an edge, or nowhere, or more is on the ray's way than solid angles cost, as in
  // a stack of many plates.
  AMHEX_HD bool CountCrossings(const Vec3d& p, int32_t& number) const {
    constexpr double kSomewhere = 1e300;
    constexpr int kMostNodes = 500;  // some 30 usually
    if (!is_closed || nodes.empty() || !(SquaredNorm(p) < kSomewhere)) return false;
    CrossingRay ray(p, nodes.data[0].low, nodes.data[0].high, Slack());
    int32_t stack[kHullStackSize];
    int size = 1;
    stack[0] = 0;
    for (int looked = 0; size > 0; ++looked) {
      if (looked == kMostNodes) return false;
      const int32_t id = stack[--size];
      const HullNode& node = nodes.data[id];
      if (!ray.MayMeet(node.low, node.high) || PushChildren(node, id, stack, size)) continue;
      for (int32_t i = node.begin; i < node.end; ++i) {
        const HullTriangle& t = triangles.data[i];
        if (!ray.Pass(t.a, t.b, t.c)) return false;
      }
    }
    number = ray.number();
    return true;
  }

  AMHEX_HD double WindingBySolidAngles(const Vec3d& p) const {
    if (nodes.empty()) return 0;
    int32_t stack[kHullStackSize];
    int size = 1;
    stack[0] = 0;
    double solid_angle = 0;
    while (size > 0) {
      const int32_t id = stack[--size];
      const HullDipole& dipole = dipoles.data[id];
      const Vec3d to_centre = dipole.centre - p;
      const double squared = SquaredNorm(to_centre);
      if (squared > dipole.far_squared) {
        solid_angle += FarSolidAngle(dipole, to_centre, squared, std::sqrt(squared));
        continue;
      }
      const HullNode& node = nodes.data[id];
      if (PushChildren(node, id, stack, size)) continue;
      for (int32_t i = node.begin; i < node.end; ++i) {
        const HullTriangle& t = triangles.data[i];
        solid_angle += SolidAngle(p, t.a, t.b, t.c);
      }
    }
    return solid_angle / (4 * std::numbers::pi);
  }

  AMHEX_HD bool IsInside(const Vec3d& p) const { return IsInsideBy(WindingNumber(p)); }
  AMHEX_HD static bool IsInsideBy(double winding) { return winding > 0.5; }

  AMHEX_HD double ExitDistance(const Vec3d& origin, const Vec3d& direction, double min_length,
                               double max_length = 1e300) const {
    if (nodes.empty()) return -1;
    const Vec3d inverse{1 / direction.x, 1 / direction.y, 1 / direction.z};
    int32_t stack[kHullStackSize];
    int size = 1;
    stack[0] = 0;
    double best = max_length;
    while (size > 0) {
      const int32_t id = stack[--size];
      const HullNode& node = nodes.data[id];
      if (EntryDistance(node, origin, inverse, best) > best) continue;
      if (PushChildren(node, id, stack, size)) continue;
      for (int32_t i = node.begin; i < node.end; ++i) {
        const double length = LengthToBack(triangles.data[i], origin, direction);
        if (length >= min_length && length < best) best = length;
      }
    }
    return best < max_length ? best : -1;
  }

  // Nearest points of triangles may be rounded to places this far outside their boxes.
  AMHEX_HD double Slack() const {
    constexpr double kShare = 0x1p-44;  // of coordinates; a few roundings are some 2^-50
    const HullNode& root = nodes.data[0];
    double largest = 0;
    for (int a = 0; a < 3; ++a) largest = Larger(largest, Larger(-root.low[a], root.high[a]));
    return kShare * largest;
  }

 private:
  struct Nearest {
    Vec3d point;
    int32_t triangle = -1;  // in leaf order
    double squared = 0;     // nothing farther is of interest
  };
  struct Waiting {
    int32_t node;
    double squared;
  };

  // Puts the children of node `id` on the stack, the left one on top; false on leaves.
  AMHEX_HD static bool PushChildren(const HullNode& node, int32_t id, int32_t* stack, int& size) {
    if (node.right < 0) return false;
    stack[size++] = node.right;
    stack[size++] = id + 1;
    return true;
  }

  // To the box with the slack around it: never above the squared distance of a triangle in it.
  AMHEX_HD static double SquaredDistanceTo(const HullNode& node, const Vec3d& p, double slack) {
    const double x = Larger(Larger(node.low.x - p.x, p.x - node.high.x) - slack, 0.0);
    const double y = Larger(Larger(node.low.y - p.y, p.y - node.high.y) - slack, 0.0);
    const double z = Larger(Larger(node.low.z - p.z, p.z - node.high.z) - slack, 0.0);
    return x * x + y * y + z * z;
  }

  // Where the ray enters the node's box, or a value above `limit` if it misses it.
  AMHEX_HD static double EntryDistance(const HullNode& node, const Vec3d& origin,
                                       const Vec3d& inverse, double limit) {
    double enter = 0, leave = limit;
    for (int axis = 0; axis < 3; ++axis) {
      const double t0 = (node.low[axis] - origin[axis]) * inverse[axis];
      const double t1 = (node.high[axis] - origin[axis]) * inverse[axis];
      const double first = t1 < t0 ? t1 : t0, last = t0 < t1 ? t1 : t0;
      // Comparisons with not-a-number (a zero direction inside the slab) leave the range as it is.
      if (enter < first) enter = first;
      if (last < leave) leave = last;
    }
    return enter <= leave ? enter : 2 * limit;
  }

  // Along the ray to a triangle that it meets from behind; negative if it does not.
  AMHEX_HD static double LengthToBack(const HullTriangle& t, const Vec3d& origin,
                                      const Vec3d& direction) {
    const Vec3d area = DoubleAreaVector(t.a, t.b, t.c);
    const double facing = Dot(area, direction);
    if (!(facing > 0)) return -1;
    const double length = Dot(area, t.a - origin) / facing;
    const Vec3d q = origin + direction * length;
    const bool is_met = Dot(area, Cross(t.b - t.a, q - t.a)) >= 0 &&
                        Dot(area, Cross(t.c - t.b, q - t.b)) >= 0 &&
                        Dot(area, Cross(t.a - t.c, q - t.c)) >= 0;
    return is_met ? length : -1;
  }

  AMHEX_HD Vec3d NearestOn(int32_t i, const Vec3d& p) const {
    const HullTriangle& t = triangles.data[i];
    return ClosestPointOnTriangle(p, t.a, t.b, t.c);
  }

#if !defined(__CUDACC__)
  // Of triangles at the same distance the one that Search comes upon first.
  void Consider(int32_t i, const Vec3d& p, Nearest& best) const {
    const Vec3d q = NearestOn(i, p);
    const double squared = SquaredNorm(q - p);
    if (squared > best.squared) return;
    const bool is_alike = squared == best.squared && best.triangle >= 0;
    if (!is_alike || ComesFirst(i, best.triangle, p)) best = {q, i, squared};
  }
  bool ComesFirst(int32_t i, int32_t other, const Vec3d& p) const {
    const double slack = Slack();
    for (int32_t id = 0; nodes.data[id].right >= 0;) {
      const int32_t left = id + 1, right = nodes.data[id].right;
      const bool is_left = i < nodes.data[left].end;
      if (is_left != (other < nodes.data[left].end)) {
        const bool right_first = SquaredDistanceTo(nodes.data[right], p, slack) <
                                 SquaredDistanceTo(nodes.data[left], p, slack);
        return is_left != right_first;
      }
      id = is_left ? left : right;
    }
    return i < other;
  }
  void SearchPackets(const Vec3d& p, Nearest& best) const {
    RunWithWidestVectors([&] {
      const auto reach = [&] { return best.squared; };
      VisitPackets(packets, p, reach, [&](int32_t i) { return Consider(i, p, best), false; });
    });
  }
  // `found`, if any, becomes a triangle that is.
  bool IsWithinByPackets(const Vec3d& p, double reach, int32_t* found = nullptr) const {
    int32_t within = -1;
    RunWithWidestVectors([&] {
      VisitPackets(
          packets, p, [reach] { return reach; },
          [&](int32_t i) {
            if (!(SquaredNorm(NearestOn(i, p) - p) <= reach)) return false;
            within = i;
            return true;
          });
    });
    if (found != nullptr && within >= 0) *found = within;
    return within >= 0;
  }
#endif

  AMHEX_HD void Search(const Vec3d& p, Nearest& best) const {
#if !defined(__CUDACC__)
    if (!packets.empty()) return SearchPackets(p, best);
#endif
    Waiting stack[kHullStackSize];
    int size = 0;
    const double slack = Slack(), root = SquaredDistanceTo(nodes.data[0], p, slack);
    if (root <= best.squared) stack[0] = {0, root}, size = 1;
    while (size > 0) {
      const Waiting entry = stack[--size];
      if (entry.squared > best.squared) continue;
      const HullNode& node = nodes.data[entry.node];
      if (node.right < 0) {
        SearchLeaf(node, p, best);
        continue;
      }
      const Waiting left{entry.node + 1, SquaredDistanceTo(nodes.data[entry.node + 1], p, slack)};
      const Waiting right{node.right, SquaredDistanceTo(nodes.data[node.right], p, slack)};
      const bool right_first = right.squared < left.squared;
      const Waiting& nearer = right_first ? right : left;
      const Waiting& farther = right_first ? left : right;
      if (farther.squared <= best.squared) stack[size++] = farther;
      if (nearer.squared <= best.squared) stack[size++] = nearer;
    }
  }

  AMHEX_HD void SearchLeaf(const HullNode& leaf, const Vec3d& p, Nearest& best) const {
    for (int32_t i = leaf.begin; i < leaf.end; ++i) {
      const Vec3d q = NearestOn(i, p);
      const double squared = SquaredNorm(q - p);
      if (squared < best.squared || (best.triangle < 0 && squared <= best.squared)) {
        best = {q, i, squared};
      }
    }
  }
};

}  // namespace amhex
