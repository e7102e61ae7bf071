#include "optimize/stays_near.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "input/hull_queries.h"
#include "optimize/hull_deviation.h"
#include "output/surface_distance.h"

namespace amhex {
namespace {

// As distances are sampled elsewhere (hull_samples), edge lengths.
constexpr double kSampleSpacing = 1.0 / 3.0;
// Of what is wanted of a mesh: following the hull comes after this, and mends so much.
constexpr double kMendable = 1.5;
// Samples beside what differs may be nearest to it.
constexpr double kBeside = 1.0;

using Place = std::array<double, 3>;

// The places of a face's corners, in an order of their own.
std::vector<Place> KeyOf(const CellFace& face, const std::vector<Vec3d>& vertices) {
  std::vector<Place> key;
  for (int j = 0; j < face.count; ++j) {
    const Vec3d& p = vertices[face.v[j]];
    key.push_back({p.x, p.y, p.z});
  }
  std::sort(key.begin(), key.end());
  return key;
}

// The faces of one part's boundary that the other does not have in the same places.
std::vector<CellFace> FacesOnlyOf(const CellComplex& part, const CellComplex& other) {
  std::set<std::vector<Place>> known;
  for (const CellFace& face : other.hull_faces) known.insert(KeyOf(face, other.vertices));
  std::vector<CellFace> only;
  for (const CellFace& face : part.hull_faces) {
    if (!known.contains(KeyOf(face, part.vertices))) only.push_back(face);
  }
  return only;
}

bool Overlap(const Box3d& a, const Box3d& b) {
  for (int axis = 0; axis < 3; ++axis) {
    if (a.low[axis] > b.high[axis] || b.low[axis] > a.high[axis]) return false;
  }
  return true;
}

std::vector<Vec3d> HullSamplesIn(const Box3d& box, const Hull& hull, const StopPoll& poll) {
  std::vector<std::array<int32_t, 3>> triangles;
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    poll.At(static_cast<int64_t>(t));
    Box3d own;
    for (const int32_t v : hull.triangles[t]) own.Extend(hull.vertices[v]);
    if (Overlap(own, box)) triangles.push_back(hull.triangles[t]);
  }
  std::vector<Vec3d> samples = SampleSurface(hull.vertices, triangles, kSampleSpacing);
  std::erase_if(samples, [&](const Vec3d& p) { return !Overlap({p, p}, box); });
  return samples;
}

double FarthestMiddle(const std::vector<CellFace>& faces, const CellComplex& part,
                      const Hull& hull) {
  double farthest = 0;
  for (const CellFace& face : faces) {
    const double distance = hull.queries->Closest(MiddleOf(face, part.vertices)).distance;
    farthest = std::max(farthest, distance);
  }
  return farthest;
}

}  // namespace

bool StaysNear(const Hull& hull, const CellComplex& before, const CellComplex& after,
               const StopPoll& poll) {
  const std::vector<CellFace> gone = FacesOnlyOf(before, after), come = FacesOnlyOf(after, before);
  if (gone.empty() && come.empty()) return true;
  if (before.hull_faces.empty() || after.hull_faces.empty()) return false;
  const double limit = kMendable * LimitsFor(hull).limit;
  const double permitted = std::max(limit, FarthestMiddle(gone, before, hull));
  if (FarthestMiddle(come, after, hull) > permitted) return false;
  Box3d box;
  const auto extend = [&](const std::vector<CellFace>& faces, const CellComplex& part) {
    for (const CellFace& face : faces) {
      for (int j = 0; j < face.count; ++j) box.Extend(part.vertices[face.v[j]]);
    }
  };
  extend(gone, before);
  extend(come, after);
  const Vec3d beside{kBeside, kBeside, kBeside};
  box = {box.low - beside, box.high + beside};
  const HullQueries old_boundary = BoundaryOf(before, poll), new_boundary = BoundaryOf(after, poll);
  const std::vector<Vec3d> samples = HullSamplesIn(box, hull, poll);
  return std::all_of(samples.begin(), samples.end(), [&](const Vec3d& p) {
    return new_boundary.IsWithin(p, limit) ||
           new_boundary.Closest(p).distance <= old_boundary.Closest(p).distance;
  });
}

}  // namespace amhex
