// Loops of three, four and five edges around a vertex of an edge network, and what they add to it;
// usable where bodies run. Section 5.2, I.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/vec3.h"
#include "topology/edge_network_view.h"
#include "topology/primitives.h"

namespace amhex {

// The ring's vertices, smallest first, the smaller neighbour of it second.
using PentaLoop = std::array<int32_t, 5>;

// The five edges across a loop.
AMHEX_HD inline std::array<VertexPair, 5> InteriorEdges(const PentaLoop& loop) {
  std::array<VertexPair, 5> edges;
  for (int i = 0; i < 5; ++i) edges[i] = {loop[i], loop[(i + 2) % 5]};
  return edges;
}

// Each search has one element per vertex: the smallest of the loops.
struct TriangleSearch {
  using Item = CellFace;
  EdgeNetworkView network;

  template <class Visit>
  AMHEX_HD void VisitItems(int64_t vertex, const Visit& visit) const {
    const auto a = static_cast<int32_t>(vertex);
    network.ForEachLargerNeighbour(a, [&](int32_t b, ArrayView<const int32_t>) {
      network.ForEachCommonNeighbour(a, b, [&](int32_t c) {
        if (c > b) visit(CellFace{3, {a, b, c, -1}});
      });
    });
  }
};

// Without an edge across: a b c d with b < d.
struct QuadSearch {
  using Item = CellFace;
  EdgeNetworkView network;

  template <class Visit>
  AMHEX_HD void VisitItems(int64_t vertex, const Visit& visit) const {
    const auto a = static_cast<int32_t>(vertex);
    network.ForEachLargerNeighbour(a, [&](int32_t b, ArrayView<const int32_t> later) {
      for (int64_t j = 0; j < later.size; ++j) {
        const int32_t d = later[j];
        if (network.AreConnected(b, d)) continue;
        network.ForEachCommonNeighbour(b, d, [&](int32_t c) {
          if (c > a && !network.AreConnected(a, c)) visit(CellFace{4, {a, b, c, d}});
        });
      }
    });
  }
};

// Without an edge across.
struct PentaLoopSearch {
  using Item = PentaLoop;
  EdgeNetworkView network;

  template <class Visit>
  AMHEX_HD void VisitItems(int64_t vertex, const Visit& visit) const {
    const auto a = static_cast<int32_t>(vertex);
    network.ForEachLargerNeighbour(a, [&](int32_t b, ArrayView<const int32_t> later) {
      for (int64_t j = 0; j < later.size; ++j) {
        if (!network.AreConnected(b, later[j])) Complete({b, a, later[j]}, visit);
      }
    });
  }

 private:
  // The path b a e to rings a b c d e.
  template <class Visit>
  AMHEX_HD void Complete(const std::array<int32_t, 3>& path, const Visit& visit) const {
    const int32_t b = path[0], a = path[1], e = path[2];
    const ArrayView<const int32_t> around = network.NeighboursOf(b);
    for (int64_t i = 0; i < around.size; ++i) {
      const int32_t c = around[i];
      if (c <= a || c == e || network.AreConnected(c, a) || network.AreConnected(c, e)) continue;
      network.ForEachCommonNeighbour(c, e, [&](int32_t d) {
        if (d <= a || d == b || network.AreConnected(d, a) || network.AreConnected(d, b)) return;
        visit(PentaLoop{a, b, c, d, e});
      });
    }
  }
};

// See IsWellShapedQuad (face_loops.h).
AMHEX_HD inline bool IsWellShaped(const CellFace& quad, ArrayView<const Vec3d> vertices) {
  // Section 5.2, I, "for trapezoidal quads": corner angles of at least pi/4, opposite edges within
  // pi/3; their cosines as they are rounded.
  constexpr double kLargestCornerCosine = 0x1.6a09e667f3bcdp-1;
  constexpr double kSmallestOppositeCosine = 0x1.0000000000001p-1;
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

// See ShortestDiagonal (face_loops.h).
AMHEX_HD inline VertexPair ShorterDiagonal(const CellFace& quad, ArrayView<const Vec3d> vertices) {
  const double first = SquaredNorm(vertices[quad.v[2]] - vertices[quad.v[0]]);
  const double second = SquaredNorm(vertices[quad.v[3]] - vertices[quad.v[1]]);
  return second < first ? VertexPair{quad.v[1], quad.v[3]} : VertexPair{quad.v[0], quad.v[2]};
}

struct WellShapedQuadSearch {
  using Item = CellFace;
  QuadSearch quads;
  ArrayView<const Vec3d> vertices;

  template <class Visit>
  AMHEX_HD void VisitItems(int64_t vertex, const Visit& visit) const {
    quads.VisitItems(vertex, [&](const CellFace& quad) {
      if (IsWellShaped(quad, vertices)) visit(quad);
    });
  }
};

// The diagonals that split the other quads.
struct DiagonalSearch {
  using Item = VertexPair;
  QuadSearch quads;
  ArrayView<const Vec3d> vertices;

  template <class Visit>
  AMHEX_HD void VisitItems(int64_t vertex, const Visit& visit) const {
    quads.VisitItems(vertex, [&](const CellFace& quad) {
      if (!IsWellShaped(quad, vertices)) visit(ShorterDiagonal(quad, vertices));
    });
  }
};

// The edges across penta-loops.
struct SpiralEdgeSearch {
  using Item = VertexPair;
  // A regular pentagon of unit edges is 1.62 across; loops much wider than that run around whole
  // cells instead of through a spiral. Edge lengths.
  static constexpr double kLongestInteriorEdge = 2.0;
  PentaLoopSearch loops;
  ArrayView<const Vec3d> vertices;

  template <class Visit>
  AMHEX_HD void VisitItems(int64_t vertex, const Visit& visit) const {
    loops.VisitItems(vertex, [&](const PentaLoop& loop) {
      const std::array<VertexPair, 5> interior = InteriorEdges(loop);
      for (const VertexPair& edge : interior) {
        if (Norm(vertices[edge[1]] - vertices[edge[0]]) > kLongestInteriorEdge) return;
      }
      for (const VertexPair& edge : interior) visit(edge);
    });
  }
};

}  // namespace amhex
