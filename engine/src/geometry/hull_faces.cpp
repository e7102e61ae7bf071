#include "geometry/hull_faces.h"

#include <algorithm>

#include "input/hull_queries.h"
#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

// In extents of the cube along the face's axis; measured: looser tests reject more good cells.
constexpr double kMaxCentreDepth = 0.35;
constexpr double kMaxCornerDepth = 0.45;
constexpr double kMinNormalCosine = 0.5;
// Nearer than this the face need not prove that its far side is outside.
constexpr double kCertainDepth = 0.15;
// Cubes, or vertices, per block of the parallel loops: about a millisecond.
constexpr int64_t kItemsPerBlock = 256;

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

uint8_t HullFacesOf(const Cubes& cubes, const HullQueries& queries, const MergedCubes& merged,
                    int cube) {
  uint8_t faces = 0;
  for (int direction = 0; direction < kDirectionCount; ++direction) {
    if (merged.matches[cube][direction] >= 0) continue;
    if (!IsHullFace(cubes, queries, merged, cube, direction)) continue;
    faces |= static_cast<uint8_t>(1 << direction);
  }
  return faces;
}

void NoteHullVertices(MergedCubes* merged) {
  merged->on_hull.assign(merged->vertices.size(), 0);
  for (size_t cube = 0; cube < merged->hull_faces.size(); ++cube) {
    for (int direction = 0; direction < kDirectionCount; ++direction) {
      if ((merged->hull_faces[cube] >> direction & 1) == 0) continue;
      for (const int corner : kCubeFaces[direction]) {
        merged->on_hull[merged->corners[cube][corner]] = 1;
      }
    }
  }
}

}  // namespace

absl::Status LabelHullFaces(const Cubes& cubes, const Hull& hull, const RunContext& run,
                            MergedCubes* merged) {
  const HullQueries& queries = *hull.queries;
  merged->hull_faces.assign(cubes.count(), 0);
  const absl::Status status =
      ForEachBlock(cubes.count(), kItemsPerBlock, run, [&](int64_t begin, int64_t end) {
        for (auto cube = static_cast<int>(begin); cube < end; ++cube) {
          merged->hull_faces[cube] = HullFacesOf(cubes, queries, *merged, cube);
        }
      });
  if (!status.ok()) return status;
  NoteHullVertices(merged);
  std::vector<Vec3d>& vertices = merged->vertices;
  return ForEachBlock(static_cast<int64_t>(vertices.size()), kItemsPerBlock, run,
                      [&](int64_t begin, int64_t end) {
                        for (int64_t v = begin; v < end; ++v) {
                          if (merged->on_hull[v]) vertices[v] = queries.Closest(vertices[v]).point;
                        }
                      });
}

}  // namespace amhex
