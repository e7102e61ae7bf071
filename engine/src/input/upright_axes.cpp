#include "input/upright_axes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "input/triangle_math.h"

namespace amhex {
namespace {

constexpr double kDegree = 0.017453292519943295;
// Normals within about this of an axis are along it.
constexpr double kAlong = 1.5 * kDegree;
// Bins of normals along each edge of a cube around them; some degree and a half each.
constexpr size_t kBins = 64;
// So many of the directions with most area suggest axes.
constexpr size_t kMaxPeaks = 32;
constexpr double kPeakDistance = 3 * kDegree;
// Two peaks suggest two axes if they are this near to perpendicular.
constexpr double kPerpendicular = 10 * kDegree;
// The axes are then turned to the mean of the normals that are ever nearer to them.
constexpr std::array<double, 3> kRefinements = {kAlong, kAlong / 3, kAlong / 10};
constexpr int kRoundsPerRefinement = 4;
constexpr double kSameShare = 1e-6;

struct Direction {
  Vec3d normal;     // unit, up to sign
  double area = 0;  // share of the surface's
};

// Of the two sides of each direction that along its largest component.
Vec3d Upward(const Vec3d& v) {
  int largest = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::abs(v[a]) > std::abs(v[largest])) largest = a;
  }
  return v[largest] < 0 ? -v : v;
}

// `v` is upward and not zero.
size_t BinOf(const Vec3d& v) {
  int side = 0;
  for (int a = 1; a < 3; ++a) {
    if (v[a] > v[side]) side = a;
  }
  const auto place = [&](int axis) {
    const double at = (v[axis] / v[side] + 1) / 2 * kBins;
    return static_cast<size_t>(std::clamp(at, 0.0, kBins - 1.0));
  };
  return (static_cast<size_t>(side) * kBins + place((side + 1) % 3)) * kBins +
         place((side + 2) % 3);
}

// The normals of the surface, those of one bin together.
std::vector<Direction> DirectionsOf(const TriangleMesh& surface, const StopPoll& poll) {
  std::vector<Vec3d> sums(3 * kBins * kBins);
  double total = 0;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    poll.At(static_cast<int64_t>(t));
    const auto& [a, b, c] = surface.triangles[t];
    const Vec3d area = Upward(DoubleAreaVector(surface.vertices[static_cast<size_t>(a)],
                                               surface.vertices[static_cast<size_t>(b)],
                                               surface.vertices[static_cast<size_t>(c)]));
    const double size = Norm(area);
    if (!(size > 0)) continue;
    sums[BinOf(area)] += area;
    total += size;
  }
  std::vector<Direction> directions;
  for (const Vec3d& sum : sums) {
    const double size = Norm(sum);
    if (size > 0) directions.push_back({sum / size, size / total});
  }
  return directions;
}

// 1 along the direction, falling to nothing beyond some `width`, in radians.
double Nearness(double cosine, double width) {
  const double squared_sine = std::max(0.0, 1 - cosine * cosine);
  return std::exp(-squared_sine / (width * width));
}

double ShareAlong(const std::vector<Direction>& directions, const AxisFrame& axes) {
  double share = 0;
  for (const Direction& direction : directions) {
    double cosine = 0;
    for (const Vec3d& axis : axes.axis) {
      cosine = std::max(cosine, std::abs(Dot(axis, direction.normal)));
    }
    share += direction.area * Nearness(cosine, kAlong);
  }
  return share;
}

// Those around which there is most area, apart from each other.
std::vector<Vec3d> PeaksOf(const std::vector<Direction>& directions) {
  std::vector<Direction> by_area = directions;
  std::stable_sort(by_area.begin(), by_area.end(),
                   [](const Direction& a, const Direction& b) { return a.area > b.area; });
  std::vector<Vec3d> peaks;
  for (const Direction& direction : by_area) {
    if (peaks.size() == kMaxPeaks) break;
    const bool is_apart = std::all_of(peaks.begin(), peaks.end(), [&](const Vec3d& peak) {
      return std::abs(Dot(peak, direction.normal)) < std::cos(kPeakDistance);
    });
    if (is_apart) peaks.push_back(direction.normal);
  }
  return peaks;
}

AxisFrame FrameOn(const Vec3d& axis, const Vec3d& near_second) {
  const Vec3d second = Normalized(near_second - axis * Dot(axis, near_second));
  return {{axis, second, Cross(axis, second)}};
}

// The world's axes with the one that is nearest turned onto `axis`.
AxisFrame WorldTurnedOnto(const Vec3d& axis) {
  int nearest = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::abs(axis[a]) > std::abs(axis[nearest])) nearest = a;
  }
  Vec3d next;
  next[(nearest + 1) % 3] = 1;
  // About the perpendicular of both: what is beside the turned axis goes along with it.
  Vec3d from;
  from[nearest] = axis[nearest] < 0 ? -1 : 1;
  const Vec3d about = Cross(from, axis);
  const double cosine = Dot(from, axis);
  const Vec3d turned =
      next * cosine + Cross(about, next) + about * (Dot(about, next) / (1 + cosine));
  return FrameOn(axis, turned);
}

double Trace(const AxisFrame& axes) { return axes.axis[0].x + axes.axis[1].y + axes.axis[2].z; }

// The same axes under the names that leave the least turn from the world's.
AxisFrame NamedLikeWorld(const AxisFrame& axes) {
  constexpr std::array<std::array<size_t, 3>, 6> kOrders = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  AxisFrame best;
  double best_trace = -3;
  for (const std::array<size_t, 3>& order : kOrders) {
    AxisFrame named;
    int least = 0;
    for (int k = 0; k < 3; ++k) {
      Vec3d& axis = named.axis[static_cast<size_t>(k)];
      axis = axes.axis[order[static_cast<size_t>(k)]];
      if (axis[k] < 0) axis = -axis;
      if (axis[k] < named.axis[static_cast<size_t>(least)][least]) least = k;
    }
    Vec3d& flipped = named.axis[static_cast<size_t>(least)];
    if (Determinant(named.axis[0], named.axis[1], named.axis[2]) < 0) flipped = -flipped;
    if (Trace(named) <= best_trace) continue;
    best_trace = Trace(named);
    best = named;
  }
  return best;
}

std::vector<AxisFrame> Suggested(const std::vector<Vec3d>& peaks) {
  std::vector<AxisFrame> frames;
  for (size_t i = 0; i < peaks.size(); ++i) {
    frames.push_back(NamedLikeWorld(WorldTurnedOnto(peaks[i])));
    for (size_t j = i + 1; j < peaks.size(); ++j) {
      if (std::abs(Dot(peaks[i], peaks[j])) > std::sin(kPerpendicular)) continue;
      frames.push_back(NamedLikeWorld(FrameOn(peaks[i], peaks[j])));
    }
  }
  return frames;
}

// Turned to the mean of the normals near each axis, the axis with most area first.
AxisFrame Refined(const AxisFrame& axes, const std::vector<Direction>& directions, double width) {
  // Where no normals are near, an axis only goes along with the others.
  constexpr double kNoArea = 1e-6;
  std::array<Vec3d, 3> means;
  for (size_t k = 0; k < 3; ++k) means[k] = axes.axis[k] * kNoArea;
  for (const Direction& direction : directions) {
    for (size_t k = 0; k < 3; ++k) {
      const double cosine = Dot(axes.axis[k], direction.normal);
      const double weight = direction.area * Nearness(cosine, width);
      means[k] += direction.normal * (cosine < 0 ? -weight : weight);
    }
  }
  std::array<size_t, 3> order = {0, 1, 2};
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return Norm(means[a]) > Norm(means[b]); });
  const AxisFrame turned = FrameOn(Normalized(means[order[0]]), means[order[1]]);
  AxisFrame refined;
  for (size_t k = 0; k < 3; ++k) refined.axis[order[k]] = turned.axis[k];
  Vec3d& last = refined.axis[order[2]];
  if (Dot(last, axes.axis[order[2]]) < 0) last = -last;
  return refined;
}

}  // namespace

UprightAxes FindUprightAxes(const TriangleMesh& surface, const StopPoll& poll) {
  const std::vector<Direction> directions = DirectionsOf(surface, poll);
  UprightAxes upright;
  upright.share_along_world = ShareAlong(directions, upright.axes);
  upright.share_along = upright.share_along_world;
  for (const AxisFrame& axes : Suggested(PeaksOf(directions))) {
    poll.Now();
    const double share = ShareAlong(directions, axes);
    const bool is_nearer =
        share > upright.share_along - kSameShare && Trace(axes) > Trace(upright.axes) + kSameShare;
    if (share < upright.share_along + kSameShare && !is_nearer) continue;
    upright.axes = axes;
    upright.share_along = share;
  }
  if (upright.share_along == upright.share_along_world) return upright;
  AxisFrame axes = upright.axes;
  for (const double width : kRefinements) {
    for (int round = 0; round < kRoundsPerRefinement; ++round) {
      axes = Refined(axes, directions, width);
      const double share = ShareAlong(directions, axes);
      if (share < upright.share_along) continue;
      upright.axes = NamedLikeWorld(axes);
      upright.share_along = share;
    }
  }
  return upright;
}

}  // namespace amhex
