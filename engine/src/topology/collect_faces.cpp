#include "topology/collect_faces.h"

#include <algorithm>

#include "base/status_macros.h"
#include "topology/face_loops.h"
#include "topology/penta_loops.h"

namespace amhex {
namespace {

// A regular pentagon of unit edges is 1.62 across; loops much wider than that run around whole
// cells instead of through a spiral.
constexpr double kLongestInteriorEdge = 2.0;  // edge lengths

double Length(const VertexPair& edge, const std::vector<Vec3d>& vertices) {
  return Norm(vertices[edge[1]] - vertices[edge[0]]);
}

absl::Status AppendPentaLoopEdges(const EdgeNetwork& network, const std::vector<Vec3d>& vertices,
                                  const RunContext& context, std::vector<VertexPair>* edges) {
  std::vector<PentaLoop> loops;
  AMHEX_RETURN_IF_ERROR(FindPentaLoops(network, context, &loops));
  for (const PentaLoop& loop : loops) {
    const std::array<VertexPair, 5> interior = InteriorEdges(loop);
    const bool is_too_wide = std::any_of(interior.begin(), interior.end(), [&](const auto& edge) {
      return Length(edge, vertices) > kLongestInteriorEdge;
    });
    if (!is_too_wide) edges->insert(edges->end(), interior.begin(), interior.end());
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<CellFace>> CollectFaces(const std::vector<Vec3d>& vertices,
                                                   const std::vector<VertexPair>& edges,
                                                   const RunContext& context) {
  const auto vertex_count = static_cast<int32_t>(vertices.size());
  const auto is_badly_shaped = [&](const CellFace& quad) {
    return !IsWellShapedQuad(quad, vertices);
  };
  EdgeNetwork network = EdgeNetwork::Build(vertex_count, edges);
  std::vector<CellFace> quads;
  AMHEX_RETURN_IF_ERROR(FindQuads(network, context, &quads));
  std::vector<VertexPair> added;
  for (const CellFace& quad : quads) {
    if (is_badly_shaped(quad)) added.push_back(ShortestDiagonal(quad, vertices));
  }
  AMHEX_RETURN_IF_ERROR(AppendPentaLoopEdges(network, vertices, context, &added));
  if (!added.empty()) {
    added.insert(added.end(), edges.begin(), edges.end());
    network = EdgeNetwork::Build(vertex_count, added);
    quads.clear();
    AMHEX_RETURN_IF_ERROR(FindQuads(network, context, &quads));
  }
  std::vector<CellFace> faces;
  AMHEX_RETURN_IF_ERROR(FindTriangles(network, context, &faces));
  quads.erase(std::remove_if(quads.begin(), quads.end(), is_badly_shaped), quads.end());
  faces.insert(faces.end(), quads.begin(), quads.end());
  return faces;
}

}  // namespace amhex
