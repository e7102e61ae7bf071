// The hierarchy of hull_view.h for the host: eight boxes at a time, down to single triangles.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "base/platform.h"
#include "base/vector_lanes.h"
#include "input/hull_depth.h"

namespace amhex {

// Part of the hierarchy with its outermost boxes, each with the slack around it (HullView::Slack)
// and rounded outward.
struct HullPacket {
  float low[3][kLanes], high[3][kLanes];  // [axis][child]; what is missing is nowhere
  int32_t child[kLanes];                  // a packet; of triangles the complement, in leaf order
};

// Every packet is at least one level of the hierarchy deep, and leaves seven waiting at most.
inline constexpr int kPacketStackSize = (kLanes - 1) * kHullStackSize + 1;

// A point in single precision, rounded both ways, so that no box is taken for farther than it is.
class PacketPoint {
 public:
  explicit PacketPoint(const Vec3d& p) {
    // No hull reaches farther, edge lengths; nearer to a box the bound is only lower.
    constexpr double kFarthest = 1e15;
    constexpr float kRounding = 0x1p-23F;  // twice that of a float
    constexpr float kLeast = 1e-18F;       // its square is no subnormal number
    for (int axis = 0; axis < 3; ++axis) {
      const auto x = static_cast<float>(Smaller(Larger(p[axis], -kFarthest), kFarthest));
      const float margin = Larger(x, -x) * kRounding + kLeast;
      up_[axis] = x + margin, down_[axis] = x - margin;
    }
  }

  // Never above the squared distance of a triangle in the box.
  AMHEX_LANES_INLINE FloatLanes SquaredDistancesTo(const HullPacket& packet) const {
    constexpr float kRoundedDown = 1 - 0x1p-20F;  // three roundings of a term, two of the sum
    const FloatLanes x = Along(0, packet), y = Along(1, packet), z = Along(2, packet);
    return (x * x + y * y + z * z) * kRoundedDown;
  }

 private:
  AMHEX_LANES_INLINE FloatLanes Along(int axis, const HullPacket& packet) const {
    const FloatLanes below = LoadFloats(packet.low[axis]) - up_[axis];
    const FloatLanes above = down_[axis] - LoadFloats(packet.high[axis]);
    const FloatLanes outside = below > above ? below : above;
    return outside < 0.0F ? FloatLanes{} : outside;
  }

  float up_[3], down_[3];
};

// Finite, and not below the square.
inline float PacketReach(double squared) {
  constexpr double kMost = 3e38;
  constexpr double kRoundedUp = 1 + 0x1p-22;
  return static_cast<float>(Smaller(squared * kRoundedUp, kMost));
}

// Calls visit(triangle) for those whose boxes are within the square root of `reach()`,
// which may fall with every visit, by way of the nearest boxes first. Ends when a visit says so.
template <class Reach, class Visit>
AMHEX_LANES_INLINE void VisitPackets(const ArrayView<const HullPacket>& packets, const Vec3d& p,
                                     const Reach& reach, const Visit& visit) {
  struct Waiting {
    float squared;
    int32_t child;
  };
  const PacketPoint point(p);
  Waiting stack[kPacketStackSize];
  int size = 0;
  for (int32_t child = 0;;) {
    if (child < 0) {
      if (visit(~child)) return;
    } else {
      const HullPacket& packet = packets.data[child];
      const FloatLanes lanes = point.SquaredDistancesTo(packet);
      float squared[kLanes];
      StoreFloats(lanes, squared);
      const uint32_t within = BitsOf(lanes <= PacketReach(reach()));
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
