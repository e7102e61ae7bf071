#include "closure/hull_apex.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "closure/star_geometry.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

// Steps of the search along the hull, in edge lengths.
constexpr double kFirstStep = 0.4;
constexpr double kSmallestStep = 0.03;
constexpr double kMinGain = 1e-4;
// An apex that starts worse than this is not worth the search.
constexpr double kHopelessStart = -0.3;
// Triangles at the apex must look the hull's way (cosine), or the mesh folds over itself there.
constexpr double kApexNormalCosine = 0.3;
constexpr double kAngleTolerance = 0.1;

// Two unit vectors that span the plane of a unit normal.
std::array<Vec3d, 2> TangentsOf(const Vec3d& normal) {
  const Vec3d helper = std::abs(normal.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d u = Normalized(Cross(normal, helper));
  return {u, Cross(normal, u)};
}

// True if the loop, seen from the apex against the hull's normal, turns once and never back. It
// looks into the cavity as the walls do, so it turns clockwise.
bool RunsOnceAround(const std::vector<int32_t>& loop, const std::vector<Vec3d>& x,
                    const HullPoint& apex) {
  const auto [u, w] = TangentsOf(apex.normal);
  double sum = 0;
  for (size_t i = 0; i < loop.size(); ++i) {
    const Vec3d a = x[loop[i]] - apex.point, b = x[loop[(i + 1) % loop.size()]] - apex.point;
    const double ax = Dot(a, u), ay = Dot(a, w), bx = Dot(b, u), by = Dot(b, w);
    const double turn = std::atan2(ax * by - ay * bx, ax * bx + ay * by);
    if (turn >= 0) return false;
    sum += turn;
  }
  return std::abs(sum + 2 * std::numbers::pi) <= kAngleTolerance;
}

bool FollowsHullAround(const Hull& hull, const std::vector<int32_t>& loop,
                       const std::vector<Vec3d>& x, const Vec3d& apex) {
  for (size_t i = 0; i < loop.size(); ++i) {
    const Vec3d &a = x[loop[i]], &b = x[loop[(i + 1) % loop.size()]];
    const Vec3d inward = Normalized(Cross(b - a, apex - a));
    const HullPoint nearest = hull.queries->Closest((a + b + apex) / 3.0);
    if (-Dot(inward, nearest.normal) < kApexNormalCosine) return false;
  }
  return true;
}

}  // namespace

std::optional<HullApex> FindHullApex(const WorkingMesh& mesh, const Hull& hull,
                                     const std::vector<CellFace>& walls,
                                     const std::vector<int32_t>& loop, const Vec3d& start) {
  const std::vector<Vec3d>& x = mesh.vertices();
  HullPoint best = hull.queries->Closest(start);
  double quality = MinStarQuality(walls, best.point, x);
  if (quality < kHopelessStart) return std::nullopt;
  double step = kFirstStep;
  while (step > kSmallestStep) {
    const auto [u, w] = TangentsOf(best.normal);
    HullPoint found = best;
    double found_quality = quality;
    for (const Vec3d& direction :
         {u, -u, w, -w, (u + w) * std::numbers::sqrt2 / 2.0, (u - w) * std::numbers::sqrt2 / 2.0,
          (w - u) * std::numbers::sqrt2 / 2.0, (-u - w) * std::numbers::sqrt2 / 2.0}) {
      const HullPoint candidate = hull.queries->Closest(best.point + direction * step);
      const double q = MinStarQuality(walls, candidate.point, x);
      if (q > found_quality) found = candidate, found_quality = q;
    }
    if (found_quality > quality + kMinGain) {
      best = found;
      quality = found_quality;
    } else {
      step /= 2;
    }
  }
  if (quality <= 0 || !RunsOnceAround(loop, x, best) ||
      !FollowsHullAround(hull, loop, x, best.point)) {
    return std::nullopt;
  }
  return HullApex{best.point, quality};
}

}  // namespace amhex
