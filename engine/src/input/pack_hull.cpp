#include "input/pack_hull.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "input/hull_split.h"

namespace amhex {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();
// The parts below a node of more triangles than this are packed side by side.
constexpr int32_t kTrianglesPackedInTurn = 2048;

float RoundedDown(double x) {
  const auto rounded = static_cast<float>(x);
  return rounded > x ? std::nextafter(rounded, -INFINITY) : rounded;
}
float RoundedUp(double x) {
  const auto rounded = static_cast<float>(x);
  return rounded < x ? std::nextafter(rounded, INFINITY) : rounded;
}

class Packer {
  using Packets = std::vector<HullPacket>;

 public:
  Packer(const HullView& hull, const StopPoll& poll)
      : hull_(hull), poll_(poll), slack_(hull.Slack()) {}

  std::vector<HullPacket> Pack() const {
    Packets packets;
    packets.reserve(static_cast<size_t>(hull_.triangles.size) / 4 + 1);
    Append(0, packets);
    return packets;
  }

 private:
  // Nodes; of triangles the complement.
  struct Children {
    std::array<int32_t, kLanes> of = {};
    int count = 0;
    void Add(int32_t child) { of[static_cast<size_t>(count++)] = child; }
  };

  int32_t TrianglesOf(int32_t node) const {
    return hull_.nodes[node].end - hull_.nodes[node].begin;
  }

  // Of a node and all below it, depth first.
  void Append(int32_t node, Packets& packets) const {
    poll_.At(node);
    const auto id = static_cast<int32_t>(packets.size());
    const Children children = ChildrenOf(node);
    packets.push_back(PacketOf(children));
    if (TrianglesOf(node) > kTrianglesPackedInTurn) return AppendTogether(id, children, packets);
    for (int lane = 0; lane < children.count; ++lane) {
      const int32_t child = children.of[static_cast<size_t>(lane)];
      if (child < 0) continue;
      packets[static_cast<size_t>(id)].child[lane] = static_cast<int32_t>(packets.size());
      Append(child, packets);
    }
  }

  // The same below packet `id`.
  void AppendTogether(int32_t id, const Children& children, Packets& packets) const {
    std::array<Packets, kLanes> parts;
    tbb::parallel_for(0, children.count, [&](int lane) {
      const int32_t child = children.of[static_cast<size_t>(lane)];
      if (child >= 0) Append(child, parts[static_cast<size_t>(lane)]);
    });
    for (int lane = 0; lane < children.count; ++lane) {
      const Packets& part = parts[static_cast<size_t>(lane)];
      if (part.empty()) continue;
      const auto first = static_cast<int32_t>(packets.size());
      packets[static_cast<size_t>(id)].child[lane] = first;
      std::transform(part.begin(), part.end(), std::back_inserter(packets),
                     [first](const HullPacket& packet) { return Shifted(packet, first); });
    }
  }
  // Node 0 is nobody's child, and a lane without a child has it.
  static HullPacket Shifted(HullPacket packet, int32_t by) {
    for (int32_t& child : packet.child) child += child > 0 ? by : 0;
    return packet;
  }

  // Its children are triangles alone; the others are to follow.
  HullPacket PacketOf(const Children& children) const {
    HullPacket packet;
    for (int lane = 0; lane < kLanes; ++lane) {
      HullBox box = {{kNowhere, kNowhere, kNowhere}, {-kNowhere, -kNowhere, -kNowhere}};
      packet.child[lane] = 0;
      if (lane < children.count) {
        const int32_t child = children.of[static_cast<size_t>(lane)];
        packet.child[lane] = std::min(child, 0);
        box = BoxOf(child);
      }
      for (int axis = 0; axis < 3; ++axis) {
        packet.low[axis][lane] = RoundedDown(box.low[axis] - slack_);
        packet.high[axis][lane] = RoundedUp(box.high[axis] + slack_);
      }
    }
    return packet;
  }

  HullBox BoxOf(int32_t child) const {
    if (child >= 0) return {hull_.nodes[child].low, hull_.nodes[child].high};
    HullBox box;
    box.Extend(hull_.triangles[~child]);
    return box;
  }

  // While there is room the largest nodes become their children. Those of so few triangles that
  // they fit become these, and keep a packet of their own otherwise.
  Children ChildrenOf(int32_t node) const {
    Children children;
    children.Add(node);
    while (children.count < kLanes) {
      const int largest = LargestOf(children);
      if (largest < 0) break;
      int32_t& child = children.of[static_cast<size_t>(largest)];
      children.Add(hull_.nodes[child].right);
      ++child;  // its left child
    }
    for (int i = 0; i < children.count; ++i) {
      const int32_t child = children.of[static_cast<size_t>(i)];
      if (child < 0 || children.count - 1 + TrianglesOf(child) > kLanes) continue;
      const HullNode& small = hull_.nodes[child];
      children.of[static_cast<size_t>(i)] = ~small.begin;
      for (int32_t t = small.begin + 1; t < small.end; ++t) children.Add(~t);
    }
    return children;
  }
  // Of those that do not fit into one packet; -1 if there is none.
  int LargestOf(const Children& children) const {
    int largest = -1;
    int32_t most = kLanes;
    for (int i = 0; i < children.count; ++i) {
      const int32_t size = TrianglesOf(children.of[static_cast<size_t>(i)]);
      if (size > most) most = size, largest = i;
    }
    return largest;
  }

  const HullView& hull_;
  const StopPoll& poll_;
  const double slack_;
};

}  // namespace

std::vector<HullPacket> PackHull(const HullView& hull, const StopPoll& poll) {
  return Packer(hull, poll).Pack();
}

}  // namespace amhex
