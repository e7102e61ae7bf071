#include "topology/face_loops.h"

#include <algorithm>
#include <cmath>

#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

constexpr int64_t kVerticesPerBlock = 1024;
// Section 5.2, I, "for trapezoidal quads".
const double kLargestCornerCosine = std::cos(M_PI / 4);     // corner angles >= pi/4
const double kSmallestOppositeCosine = std::cos(M_PI / 3);  // opposite edges within pi/3

// Quads whose smallest vertex is `a`: a b c d with b < d.
void FindQuadsAt(const EdgeNetwork& network, int32_t a, std::vector<CellFace>* quads) {
  const auto around = network.neighbours(a);
  for (size_t i = 0; i < around.size(); ++i) {
    const int32_t b = around[i];
    if (b < a) continue;
    for (size_t j = i + 1; j < around.size(); ++j) {
      const int32_t d = around[j];
      if (network.AreConnected(b, d)) continue;
      for (const int32_t c : CommonNeighbours(network, b, d)) {
        if (c > a && !network.AreConnected(a, c)) quads->push_back({4, {a, b, c, d}});
      }
    }
  }
}

}  // namespace

absl::Status FindTriangles(const EdgeNetwork& network, const RunContext& context,
                           std::vector<CellFace>* triangles) {
  return CollectFromBlocks(network.edge_count(), kVerticesPerBlock, context, triangles,
                           [&](int64_t begin, int64_t end, std::vector<CellFace>* found) {
                             for (int64_t e = begin; e < end; ++e) {
                               const auto [a, b] = network.edge(static_cast<int32_t>(e));
                               for (const int32_t c : CommonNeighbours(network, a, b)) {
                                 if (c > b) found->push_back({3, {a, b, c, -1}});
                               }
                             }
                           });
}

absl::Status FindQuads(const EdgeNetwork& network, const RunContext& context,
                       std::vector<CellFace>* quads) {
  return CollectFromBlocks(network.vertex_count(), kVerticesPerBlock, context, quads,
                           [&](int64_t begin, int64_t end, std::vector<CellFace>* found) {
                             for (int64_t a = begin; a < end; ++a) {
                               FindQuadsAt(network, static_cast<int32_t>(a), found);
                             }
                           });
}

bool IsWellShapedQuad(const CellFace& quad, const std::vector<Vec3d>& vertices) {
  std::array<Vec3d, 4> edge;
  for (int i = 0; i < 4; ++i) {
    edge[i] = Normalized(vertices[quad.v[(i + 1) % 4]] - vertices[quad.v[i]]);
  }
  for (int i = 0; i < 4; ++i) {
    const double corner_cosine = -Dot(edge[i], edge[(i + 3) % 4]);
    if (corner_cosine > kLargestCornerCosine) return false;
  }
  return -Dot(edge[0], edge[2]) >= kSmallestOppositeCosine &&
         -Dot(edge[1], edge[3]) >= kSmallestOppositeCosine;
}

VertexPair ShortestDiagonal(const CellFace& quad, const std::vector<Vec3d>& vertices) {
  const double first = SquaredNorm(vertices[quad.v[2]] - vertices[quad.v[0]]);
  const double second = SquaredNorm(vertices[quad.v[3]] - vertices[quad.v[1]]);
  return second < first ? VertexPair{quad.v[1], quad.v[3]} : VertexPair{quad.v[0], quad.v[2]};
}

}  // namespace amhex
