// The hierarchy of hull_view.h for the host: eight boxes at a time, down to single triangles.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "base/vector_lanes.h"
#include "input/hull_depth.h"

namespace amhex {

// Part of the hierarchy with its outermost boxes, each with the slack around it (HullView::Slack)
// and rounded outward.
struct HullPacket {
  float low[3][kLanes], high[3][kLanes];  // [axis][child]; what is missing is nowhere
  int32_t child[kLanes];                  // a packet; of triangles the complement, in leaf order
};

using FloatLanes = float __attribute__((vector_size(kLanes * sizeof(float)), aligned(4)));

// Every packet is at least one level of the hierarchy deep, and leaves seven waiting at most.
inline constexpr int kPacketStackSize = (kLanes - 1) * kHullStackSize + 1;

AMHEX_LANES_INLINE DoubleLanes LoadBounds(const float* bounds) {
  return __builtin_convertvector(*reinterpret_cast<const FloatLanes*>(bounds), DoubleLanes);
}

// Never above the squared distance of a triangle in the box.
AMHEX_LANES_INLINE DoubleLanes SquaredDistancesTo(const HullPacket& packet, const Vec3d& p) {
  const auto along = [&](int axis) {
    const DoubleLanes below = LoadBounds(packet.low[axis]) - p[axis];
    const DoubleLanes above = p[axis] - LoadBounds(packet.high[axis]);
    const DoubleLanes outside = below > 0.0 ? below : DoubleLanes{};
    return outside > above ? outside : above;
  };
  const DoubleLanes x = along(0), y = along(1), z = along(2);
  return x * x + y * y + z * z;
}

// Bit by bit, which lanes are true.
AMHEX_LANES_INLINE uint32_t BitsOf(const LaneMask& mask) {
  int64_t bits = 0;
  for (int lane = 0; lane < kLanes; ++lane) bits |= mask[lane] & (int64_t{1} << lane);
  return static_cast<uint32_t>(bits);
}

// Calls visit(triangle) for those whose boxes are within the square root of `reach()`,
// which may fall with every visit, by way of the nearest boxes first. Ends when a visit says so.
template <class Reach, class Visit>
AMHEX_LANES_INLINE void VisitPackets(const ArrayView<const HullPacket>& packets, const Vec3d& p,
                                     const Reach& reach, const Visit& visit) {
  struct Waiting {
    double squared;
    int32_t child;
  };
  Waiting stack[kPacketStackSize];
  int size = 0;
  for (int32_t child = 0;;) {
    if (child < 0) {
      if (visit(~child)) return;
    } else {
      const HullPacket& packet = packets.data[child];
      const DoubleLanes lanes = SquaredDistancesTo(packet, p);
      double squared[kLanes];
      for (int lane = 0; lane < kLanes; ++lane) squared[lane] = lanes[lane];
      const uint32_t within = BitsOf(lanes <= reach());
      int nearest = -1;
      for (uint32_t left = within; left != 0; left &= left - 1) {
        const int lane = LowestBit(left);
        if (nearest < 0 || squared[lane] < squared[nearest]) nearest = lane;
      }
      if (nearest >= 0) {
        for (uint32_t left = within & ~(1U << nearest); left != 0; left &= left - 1) {
          const int lane = LowestBit(left);
          stack[size++] = {squared[lane], packet.child[lane]};
        }
        child = packet.child[nearest];
        continue;
      }
    }
    do {
      if (size == 0) return;
      --size;
    } while (stack[size].squared > reach());
    child = stack[size].child;
  }
}

}  // namespace amhex
