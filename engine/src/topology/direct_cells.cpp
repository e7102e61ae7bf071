#include "topology/direct_cells.h"

#include "base/status_macros.h"
#include "optimize/cell_pattern.h"
#include "optimize/cell_quality.h"
#include "topology/parallel_blocks.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

constexpr int64_t kCubesPerBlock = 4096;  // about a millisecond of work

}  // namespace

absl::StatusOr<std::vector<Primitive>> FindDirectCells(const MergedCubes& cubes,
                                                       const MeshingParams& params,
                                                       const RunContext& context) {
  std::vector<Primitive> primitives;
  AMHEX_RETURN_IF_ERROR(CollectFromBlocks(
      static_cast<int64_t>(cubes.corners.size()), kCubesPerBlock, context, &primitives,
      [&](int64_t begin, int64_t end, std::vector<Primitive>* found) {
        for (int64_t i = begin; i < end; ++i) {
          const CellPattern* pattern = FindCellPattern(cubes.corners[i]);
          if (pattern == nullptr) continue;
          const double quality = CellQuality(cubes.corners[i], cubes.vertices);
          if (!(quality > params.assembly.min_quality)) continue;
          Primitive primitive;
          primitive.corners = cubes.corners[i];
          primitive.type = pattern->type;
          primitive.cube = static_cast<int32_t>(i);
          primitive.quality = quality;
          found->push_back(primitive);
        }
      }));
  return primitives;
}

void LookUpHalfFaces(const FaceTable& faces, Primitive* primitive) {
  primitive->face_count = 0;
  for (const CellFace& face : FacesOf(primitive->corners)) {
    primitive->half_faces[primitive->face_count++] = faces.Find(face);
  }
}

std::vector<uint8_t> MarkHullFaces(const MergedCubes& cubes, const FaceTable& faces) {
  std::vector<uint8_t> on_hull(static_cast<size_t>(faces.half_face_count()), 0);
  const auto mark = [&](const CellFace& face) {
    const HalfFaceId id = faces.Find(face);
    if (id != kNoHalfFace) on_hull[id] = 1;
  };
  for (size_t i = 0; i < cubes.corners.size(); ++i) {
    if (cubes.hull_faces[i] == 0) continue;
    for (int direction = 0; direction < 6; ++direction) {
      if ((cubes.hull_faces[i] >> direction & 1) == 0) continue;
      const CellFace face = FaceInDirection(cubes.corners[i], direction);
      if (face.count > 0) mark(face);
      for (int j = 0; j < 4 && face.count == 4; ++j) {
        mark({3, {face.v[j], face.v[(j + 1) % 4], face.v[(j + 2) % 4], -1}});
      }
    }
  }
  return on_hull;
}

}  // namespace amhex
