#include "input/acute_tips.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "input/hull_queries.h"

namespace amhex {
namespace {

// Of half of 50 degrees.
constexpr double kCosine = 0.9063;
constexpr double kTangent = 0.4663;
// The solid is looked at so far from the apex, in steps of an edge length.
constexpr int kLeastSteps = 3;
constexpr int kMostSteps = 30;
// Cells end this far before the apex, or by this share of the box's diagonal: three quarters and a
// half of what a boundary may miss of the hull (optimize/hull_deviation).
constexpr double kLeastBlunted = 0.12;
constexpr double kBluntedShare = 0.0025;
constexpr double kHalfWidth = 0.5;  // of a cell, edge lengths

// [vertex] sum of the unit vectors along its edges; of a closed surface every edge once.
std::vector<Vec3d> SumsOfEdges(const Hull& hull) {
  std::vector<Vec3d> sums(hull.vertices.size());
  for (const auto& t : hull.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const auto v = static_cast<size_t>(t[i]), next = static_cast<size_t>(t[(i + 1) % 3]);
      sums[v] += Normalized(hull.vertices[next] - hull.vertices[v]);
    }
  }
  return sums;
}

// 1 for vertices all of whose edges are within half the angle of their mean.
std::vector<uint8_t> MayBeApexes(const Hull& hull, const std::vector<Vec3d>& sums) {
  std::vector<uint8_t> may_be(hull.vertices.size(), 1);
  for (const auto& t : hull.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const auto v = static_cast<size_t>(t[i]), next = static_cast<size_t>(t[(i + 1) % 3]);
      if (may_be[v] == 0) continue;
      const Vec3d edge = Normalized(hull.vertices[next] - hull.vertices[v]);
      if (!(Dot(edge, Normalized(sums[v])) > kCosine)) may_be[v] = 0;
    }
  }
  return may_be;
}

std::optional<AcuteTip> TipAt(const Hull& hull, const Vec3d& apex, const Vec3d& inward) {
  AcuteTip tip{apex, -inward, std::max(kLeastBlunted, kBluntedShare * hull.input_diagonal), 0};
  for (int step = 1; step <= kMostSteps; ++step) {
    const double depth = -hull.queries->SignedDistance(apex + inward * step);
    const bool is_in_cone = depth > 0 && depth < kTangent * step;
    if (step <= kLeastSteps && !is_in_cone) return std::nullopt;
    if (step > kLeastSteps && (!is_in_cone || depth >= kHalfWidth)) break;
    tip.narrow = step;
  }
  return tip;
}

}  // namespace

std::vector<AcuteTip> AcuteTips(const Hull& hull, const StopPoll& poll) {
  const std::vector<Vec3d> sums = SumsOfEdges(hull);
  poll.Now();
  const std::vector<uint8_t> may_be = MayBeApexes(hull, sums);
  std::vector<AcuteTip> tips;
  for (size_t v = 0; v < sums.size(); ++v) {
    if (may_be[v] == 0 || sums[v] == Vec3d{}) continue;
    poll.Now();
    const std::optional<AcuteTip> tip = TipAt(hull, hull.vertices[v], Normalized(sums[v]));
    if (tip.has_value()) tips.push_back(*tip);
  }
  return tips;
}

}  // namespace amhex
