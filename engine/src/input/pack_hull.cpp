#include "input/pack_hull.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "input/hull_split.h"

namespace amhex {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();

float RoundedDown(double x) {
  const auto rounded = static_cast<float>(x);
  return rounded > x ? std::nextafter(rounded, -INFINITY) : rounded;
}
float RoundedUp(double x) {
  const auto rounded = static_cast<float>(x);
  return rounded < x ? std::nextafter(rounded, INFINITY) : rounded;
}

class Packer {
 public:
  Packer(const HullView& hull, const StopPoll& poll)
      : hull_(hull), poll_(poll), slack_(hull.Slack()) {}

  std::vector<HullPacket> Pack() {
    packets_.reserve(static_cast<size_t>(hull_.triangles.size) / 4 + 1);
    AppendPacket(0);
    return std::move(packets_);
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

  // Its index.
  int32_t AppendPacket(int32_t node) {
    poll_.At(node);
    const auto id = static_cast<int32_t>(packets_.size());
    packets_.emplace_back();
    const Children children = ChildrenOf(node);
    for (int lane = 0; lane < kLanes; ++lane) {
      HullBox box = {{kNowhere, kNowhere, kNowhere}, {-kNowhere, -kNowhere, -kNowhere}};
      int32_t child = 0;
      if (lane < children.count) {
        child = children.of[static_cast<size_t>(lane)];
        box = BoxOf(child);
        if (child >= 0) child = AppendPacket(child);
      }
      HullPacket& own = packets_[static_cast<size_t>(id)];
      own.child[lane] = child;
      for (int axis = 0; axis < 3; ++axis) {
        own.low[axis][lane] = RoundedDown(box.low[axis] - slack_);
        own.high[axis][lane] = RoundedUp(box.high[axis] + slack_);
      }
    }
    return id;
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
  std::vector<HullPacket> packets_;
};

}  // namespace

std::vector<HullPacket> PackHull(const HullView& hull, const StopPoll& poll) {
  return Packer(hull, poll).Pack();
}

}  // namespace amhex
