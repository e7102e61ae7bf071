#include "input/winding_in_lanes.h"

#include <algorithm>
#include <numbers>

#include "base/vector_lanes.h"
#include "base/widest_vectors.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

static_assert(kPointsAtOnce == kLanes && kLanes == 8, "lanes are told apart by the bits of a byte");

AMHEX_LANES_INLINE LaneMask MaskOf(uint32_t bits) {
  constexpr LaneMask kBits = {1, 2, 4, 8, 16, 32, 64, 128};
  return (kBits & static_cast<int64_t>(bits)) != 0;
}

AMHEX_LANES_INLINE uint32_t BitsOf(const LaneMask& mask) {
  uint32_t bits = 0;
  for (int lane = 0; lane < kLanes; ++lane) bits |= mask[lane] != 0 ? 1U << lane : 0U;
  return bits;
}

// Every point walks the hierarchy as HullView::WindingNumber does, all of them together: in the
// order of the nodes, so that each one's sum has the same terms in the same order.
AMHEX_LANES_INLINE void Walk(const HullView& hull, const Vec3d* points, int count,
                             double* solid_angle) {
  VectorLanes p;
  for (int lane = 0; lane < kLanes; ++lane) p.Set(lane, points[std::min(lane, count - 1)]);
  struct Waiting {
    int32_t node;
    uint32_t lanes;
  };
  Waiting stack[kHullStackSize];
  int size = 1;
  stack[0] = {0, (1U << count) - 1};
  DoubleLanes sum{};
  while (size > 0) {
    const Waiting entry = stack[--size];
    const HullDipole& dipole = hull.dipoles.data[entry.node];
    const VectorLanes to_centre = p.Towards(dipole.centre);
    const DoubleLanes squared = to_centre.Dot(to_centre);
    const uint32_t far = entry.lanes & BitsOf(squared > dipole.far_squared);
    if (far != 0) {
      const DoubleLanes angle = FarSolidAngle(dipole, to_centre, squared, SquareRoot(squared));
      sum = MaskOf(far) ? sum + angle : sum;
    }
    const uint32_t near = entry.lanes & ~far;
    if (near == 0) continue;
    const HullNode& node = hull.nodes.data[entry.node];
    if (node.right >= 0) {
      stack[size++] = {node.right, near};
      stack[size++] = {entry.node + 1, near};
      continue;
    }
    for (int32_t i = node.begin; i < node.end; ++i) {
      const HullTriangle& t = hull.triangles.data[i];
      for (uint32_t left = near; left != 0; left &= left - 1) {
        const int lane = LowestBit(left);
        sum[lane] += SolidAngle(points[lane], t.a, t.b, t.c);
      }
    }
  }
  for (int lane = 0; lane < kLanes; ++lane) solid_angle[lane] = sum[lane];
}

}  // namespace

std::array<double, kPointsAtOnce> WindingNumbers(const HullView& hull, const Vec3d* points,
                                                 int count) {
  std::array<double, kPointsAtOnce> winding{};
  if (count == 0 || hull.nodes.empty()) return winding;
  // Lanes are worth it from a few points on.
  constexpr int kFewestForLanes = 3;
  if (count < kFewestForLanes) {
    for (int i = 0; i < count; ++i) winding[i] = hull.WindingNumber(points[i]);
    return winding;
  }
  RunWithWidestVectors([&] { Walk(hull, points, count, winding.data()); });
  for (double& angle : winding) angle /= 4 * std::numbers::pi;
  return winding;
}

}  // namespace amhex
