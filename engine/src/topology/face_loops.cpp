#include "topology/face_loops.h"

#include "base/array_view_of.h"
#include "topology/loop_search.h"
#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

constexpr int64_t kFaceLoopStartsPerBlock = 1024;

}  // namespace

absl::Status FindTriangles(const EdgeNetwork& network, const RunContext& context,
                           std::vector<CellFace>* triangles) {
  return CollectItems(network.vertex_count(), kFaceLoopStartsPerBlock, context,
                      TriangleSearch{network.view()}, triangles);
}

absl::Status FindQuads(const EdgeNetwork& network, const RunContext& context,
                       std::vector<CellFace>* quads) {
  return CollectItems(network.vertex_count(), kFaceLoopStartsPerBlock, context,
                      QuadSearch{network.view()}, quads);
}

bool IsWellShapedQuad(const CellFace& quad, const std::vector<Vec3d>& vertices) {
  return IsWellShaped(quad, ArrayViewOf(vertices));
}

VertexPair ShortestDiagonal(const CellFace& quad, const std::vector<Vec3d>& vertices) {
  return ShorterDiagonal(quad, ArrayViewOf(vertices));
}

}  // namespace amhex
