#include "geometry/hull_faces.h"

#include <algorithm>

#include "input/hull_queries.h"

namespace amhex {
namespace {

// In extents of the cube along the face's axis; measured: looser tests reject more good cells.
constexpr double kMaxCentreDepth = 0.35;
constexpr double kMaxCornerDepth = 0.45;
constexpr double kMinNormalCosine = 0.5;
// Nearer than this the face need not prove that its far side is outside.
constexpr double kCertainDepth = 0.15;

bool IsHullFace(const Cubes& cubes, const HullQueries& queries, const MergedCubes& merged, int cube,
                int direction) {
  const double extent = 2 * cubes.half_extent[cube][direction / 2];
  const Vec3d centre = cubes.FaceCentre(cube, direction);
  const Vec3d normal = cubes.FaceNormal(cube, direction);
  const HullPoint nearest = queries.Closest(centre, kMaxCentreDepth * extent);
  if (nearest.triangle < 0 || Dot(nearest.normal, normal) < kMinNormalCosine) return false;
  for (const int corner : kCubeFaces[direction]) {
    const Vec3d& vertex = merged.vertices[merged.corners[cube][corner]];
    if (queries.Closest(vertex, kMaxCornerDepth * extent).triangle < 0) return false;
  }
  return nearest.distance < kCertainDepth * extent ||
         !queries.IsInside(centre + normal * (0.5 * extent));
}

}  // namespace

void LabelHullFaces(const Cubes& cubes, const Hull& hull, MergedCubes* merged) {
  const HullQueries& queries = *hull.queries;
  merged->hull_faces.assign(cubes.count(), 0);
  merged->on_hull.assign(merged->vertices.size(), 0);
  for (int cube = 0; cube < cubes.count(); ++cube) {
    for (int direction = 0; direction < kDirectionCount; ++direction) {
      if (merged->matches[cube][direction] >= 0) continue;
      if (!IsHullFace(cubes, queries, *merged, cube, direction)) continue;
      merged->hull_faces[cube] |= static_cast<uint8_t>(1 << direction);
      for (const int corner : kCubeFaces[direction]) {
        merged->on_hull[merged->corners[cube][corner]] = 1;
      }
    }
  }
  for (size_t v = 0; v < merged->vertices.size(); ++v) {
    if (merged->on_hull[v]) merged->vertices[v] = queries.Closest(merged->vertices[v]).point;
  }
}

}  // namespace amhex
