// Faces that open gaps between indirect neighbours; usable where bodies run. Paper: section 5.1,
// "Closing Cuts", Figure 9.
#pragma once

#include <cstdint>

#include "geometry/merge_view.h"

namespace amhex {

// An open face at one of its merged edges.
struct OpenEdge {
  int32_t low = 0, high = 0;  // merge sets of the edge's ends
  int32_t cube = 0;
  uint8_t direction = 0, corner = 0;

  AMHEX_HD bool IsOfSameEdge(const OpenEdge& other) const {
    return low == other.low && high == other.high;
  }
};

// Those of every cube.
struct OpenEdgeSearch {
  using Item = OpenEdge;
  MergeView sets;
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t element, const Visit& visit) const {
    const auto cube = static_cast<int32_t>(element);
    for (int direction = 0; direction < kDirectionCount; ++direction) {
      if (sets.matches[6 * element + direction] >= 0) continue;
      for (int q = 0; q < 4; ++q) {
        const int32_t a = sets.Find(8 * cube + CornerOfFace(direction, q));
        const int32_t b = sets.Find(8 * cube + CornerOfFace(direction, (q + 1) % 4));
        if (a == b) continue;
        visit(OpenEdge{Smaller(a, b), Larger(a, b), cube, static_cast<uint8_t>(direction),
                       static_cast<uint8_t>(q)});
      }
    }
  }
};

// The cuts between an open edge and later ones of the same edge.
struct CutSearch {
  using Item = FacePair;
  CubesView cubes;
  ArrayView<const OpenEdge> edges;  // sorted by low, high and as OpenEdgeSearch finds them
  double max_gap = 0;               // mean cell sizes
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t i, const Visit& visit) const {
    for (int64_t j = i + 1; j < edges.size && edges[i].IsOfSameEdge(edges[j]); ++j) {
      VisitCut(edges[i], edges[j], visit);
    }
  }

 private:
  template <class Visit>
  AMHEX_HD void VisitCut(const OpenEdge& a, const OpenEdge& b, const Visit& visit) const {
    // Cosine between the normals of two faces that close a cut: at least 113 degrees apart.
    constexpr double kMaxNormalCosine = -0.4;
    // Cubes whose centres are nearer than this share of their size overlap: not a cut.
    constexpr double kMinCentreDistance = 0.4;
    if (a.cube == b.cube) return;
    const double cosine =
        Dot(cubes.FaceNormal(a.cube, a.direction), cubes.FaceNormal(b.cube, b.direction));
    if (cosine > kMaxNormalCosine) return;
    const double size = cubes.mean_half[a.cube] + cubes.mean_half[b.cube];
    const double gap =
        Norm(cubes.FaceCentre(a.cube, a.direction) - cubes.FaceCentre(b.cube, b.direction)) / size;
    if (gap > max_gap) return;
    if (Norm(cubes.centre[a.cube] - cubes.centre[b.cube]) < kMinCentreDistance * size) return;
    if (cubes.AreApart(a.cube, b.cube)) return;
    // Corners are paired around the shared edge: its ends, seen from b, the other way round.
    visit(FacePair{gap, a.cube, b.cube, a.direction, b.direction,
                   static_cast<uint8_t>((a.corner + b.corner + 1) % 4), a.corner, 1});
  }
};

}  // namespace amhex
