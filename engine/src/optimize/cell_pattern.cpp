#include "optimize/cell_pattern.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "topology/primitives.h"

namespace amhex {
namespace {

constexpr int kMaskCount = 1 << 12;  // one bit per cube edge

// The corners that collapsing the masked cube edges leaves: every slot names its class's first.
CellCorners CornersOfMask(int mask) {
  CellCorners corners;
  std::iota(corners.begin(), corners.end(), 0);
  for (bool changed = true; changed;) {
    changed = false;
    for (int e = 0; e < 12; ++e) {
      if (!(mask >> e & 1)) continue;
      int32_t& a = corners[kCubeEdges[e][0]];
      int32_t& b = corners[kCubeEdges[e][1]];
      if (a == b) continue;
      a = b = a < b ? a : b;
      changed = true;
    }
  }
  return corners;
}

int MaskOf(const CellCorners& corners) {
  int mask = 0;
  for (int e = 0; e < 12; ++e) {
    mask |= static_cast<int>(corners[kCubeEdges[e][0]] == corners[kCubeEdges[e][1]]) << e;
  }
  return mask;
}

void AddEdges(const CellFaces& faces, CellPattern& pattern) {
  for (const CellFace& face : faces) {
    for (int j = 0; j < face.count; ++j) {
      const int32_t a = face.v[j], b = face.v[(j + 1) % face.count];
      // Every edge runs once in each direction over the faces; keep the ascending one.
      if (a < b) {
        pattern.edge_slots[pattern.edge_count++] = {static_cast<uint8_t>(a),
                                                    static_cast<uint8_t>(b)};
      }
    }
  }
}

void SetCornerEdge(const CellPattern& pattern, int32_t other, int position,
                   CellPattern::Corner& corner) {
  for (int e = 0; e < pattern.edge_count; ++e) {
    const auto [low, high] = pattern.edge_slots[e];
    const bool away = low == corner.slot && high == other;
    const bool towards = high == corner.slot && low == other;
    if (!away && !towards) continue;
    corner.edge[position] = static_cast<uint8_t>(e);
    if (towards) corner.sign = -corner.sign;
  }
}

void AddCorners(const CellFaces& faces, CellPattern& pattern) {
  for (int i = 0; i < pattern.vertex_count; ++i) {
    const int32_t v = pattern.vertex_slot[i];
    std::vector<std::pair<int32_t, int32_t>> wedges;  // (next, previous) on each face at v
    for (const CellFace& face : faces) {
      for (int j = 0; j < face.count; ++j) {
        if (face.v[j] != v) continue;
        wedges.push_back({face.v[(j + 1) % face.count], face.v[(j + face.count - 1) % face.count]});
      }
    }
    if (wedges.size() != 3) continue;
    // On an outward face the inside lies to the left of next x previous, so the third edge
    // completes previous, next, third to a right-handed triple.
    const auto [next, previous] = wedges[0];
    int32_t third = -1;
    for (const auto& wedge : wedges) {
      if (wedge.first == previous) third = wedge.second;
    }
    CellPattern::Corner& corner = pattern.corner[pattern.corner_count++];
    corner.slot = static_cast<uint8_t>(v);
    SetCornerEdge(pattern, previous, 0, corner);
    SetCornerEdge(pattern, next, 1, corner);
    SetCornerEdge(pattern, third, 2, corner);
  }
}

void AddIncidences(CellPattern& pattern) {
  for (int e = 0; e < pattern.edge_count; ++e) {
    for (const uint8_t slot : pattern.edge_slots[e]) {
      pattern.edges_at[slot] = static_cast<uint16_t>(pattern.edges_at[slot] | 1 << e);
    }
  }
  for (int i = 0; i < pattern.corner_count; ++i) {
    for (const uint8_t e : pattern.corner[i].edge) {
      for (const uint8_t slot : pattern.edge_slots[e]) {
        pattern.corners_at[slot] = static_cast<uint8_t>(pattern.corners_at[slot] | 1 << i);
      }
    }
  }
}

void AddTriangles(const CellFaces& faces, CellPattern& pattern) {
  for (const CellFace& face : faces) {
    const int triangles = face.count == 3 ? 1 : 4;
    for (int j = 0; j < triangles; ++j) {
      auto& triangle = pattern.triangle_slots[pattern.triangle_count++];
      for (int k = 0; k < 3; ++k) {
        triangle[k] = static_cast<uint8_t>(face.v[(j + k) % face.count]);
      }
    }
  }
}

void AddLaneOrders(CellPattern& pattern) {
  for (int e = 0; e < 16; ++e) {
    const auto [from, to] = pattern.edge_slots[e < pattern.edge_count ? e : 0];
    pattern.edge_from[e] = from, pattern.edge_to[e] = to;
  }
  for (int i = 0; i < 8; ++i) {
    const CellPattern::Corner& corner = pattern.corner[i < pattern.corner_count ? i : 0];
    pattern.corner_sign[i] = corner.sign;
    for (int k = 0; k < 3; ++k) pattern.corner_edge[k][i] = corner.edge[k];
  }
  for (int t = 0; t < 24; ++t) {
    const auto& triangle = pattern.triangle_slots[t < pattern.triangle_count ? t : 0];
    for (int k = 0; k < 3; ++k) pattern.triangle_corner[k][t] = triangle[k];
  }
}

int DegreeOf(uint8_t slot, const CellPattern& pattern) {
  int degree = 0;
  for (int e = 0; e < pattern.edge_count; ++e) {
    degree += pattern.edge_slots[e][0] == slot || pattern.edge_slots[e][1] == slot;
  }
  return degree;
}

const CellFace& FirstQuad(const CellFaces& faces) {
  const CellFace* quad = faces.begin();
  while (quad->count != 4) ++quad;
  return *quad;
}

// The vertex of `pattern` that is on none of the corners of `face`.
int32_t VertexOff(const CellFace& face, const CellPattern& pattern) {
  int i = 0;
  while (std::find(face.v.begin(), face.v.end(), pattern.vertex_slot[i]) != face.v.end()) ++i;
  return pattern.vertex_slot[i];
}

// Slice 0 1 1 2 3 4 4 3: vertex 4, of two edges, follows 1 and precedes 3 on quad 0143, whose
// corner across is 0; across on the other quad, 1234, is 2.
CellCorners RelistedSlice(const CellFaces& faces, const CellPattern& pattern) {
  int32_t middle = -1;
  for (int i = 0; i < pattern.vertex_count; ++i) {
    if (DegreeOf(pattern.vertex_slot[i], pattern) == 2) middle = pattern.vertex_slot[i];
  }
  std::array<int32_t, 2> across{};
  int32_t v1 = -1, v3 = -1;
  int quad_count = 0;
  for (const CellFace& face : faces) {
    for (int j = 0; j < face.count; ++j) {
      if (face.count != 4 || face.v[j] != middle) continue;
      across[quad_count] = face.v[(j + 2) % 4];
      if (quad_count++ == 0) v1 = face.v[(j + 3) % 4], v3 = face.v[(j + 1) % 4];
    }
  }
  return {across[0], v1, v1, across[1], v3, middle, middle, v3};
}

// In slots, like all of the pattern.
CellCorners Relisted(const CellFaces& faces, const CellPattern& pattern) {
  switch (pattern.type) {
    case PrimitiveType::kTetrahedron: {
      const CellFace& base = faces.face[0];
      return MakeTetrahedronOn({base.v[0], base.v[1], base.v[2]}, VertexOff(base, pattern));
    }
    case PrimitiveType::kPyramid: {
      const CellFace& base = FirstQuad(faces);
      return MakePyramid(base.v, VertexOff(base, pattern));
    }
    case PrimitiveType::kSlice:
      return RelistedSlice(faces, pattern);
    default:  // all collapses to these types are turns of the listed one
      return CornersOfMask(0);
  }
}

struct PatternTable {
  std::array<int16_t, kMaskCount> index{};  // into patterns, or -1
  std::vector<CellPattern> patterns;

  PatternTable() {
    for (int mask = 0; mask < kMaskCount; ++mask) {
      index[mask] = -1;
      const CellCorners corners = CornersOfMask(mask);
      if (MaskOf(corners) != mask) continue;  // implies further collapses; never seen on a cell
      const std::optional<PrimitiveType> type = RecognizeCell(corners);
      if (!type.has_value()) continue;
      CellPattern pattern;
      pattern.type = *type;
      for (const int32_t v : VerticesOf(corners)) {
        pattern.vertex_slot[pattern.vertex_count++] = static_cast<uint8_t>(v);
      }
      const CellFaces faces = FacesOf(corners);
      AddEdges(faces, pattern);
      AddCorners(faces, pattern);
      AddIncidences(pattern);
      AddTriangles(faces, pattern);
      AddLaneOrders(pattern);
      index[mask] = static_cast<int16_t>(patterns.size());
      patterns.push_back(pattern);
    }
  }
};

const PatternTable& Table() {
  static const PatternTable kTable;
  return kTable;
}

}  // namespace

const std::vector<CellPattern>& AllCellPatterns() { return Table().patterns; }

const CellPattern* FindCellPattern(const CellCorners& corners) {
  const PatternTable& table = Table();
  const int16_t index = table.index[MaskOf(corners)];
  if (index < 0) return nullptr;
  const CellPattern& pattern = table.patterns[index];
  // Equal corners that no collapsed edge joins (a collapsed diagonal) are not in the mask.
  for (int i = 0; i < pattern.vertex_count; ++i) {
    for (int j = 0; j < i; ++j) {
      if (corners[pattern.vertex_slot[i]] == corners[pattern.vertex_slot[j]]) return nullptr;
    }
  }
  return &pattern;
}

CellCorners AsListedInFigure2(const CellCorners& corners) {
  const CellPattern* pattern = FindCellPattern(corners);
  if (pattern == nullptr || pattern->vertex_count > 5) return corners;
  const CellCorners slots = CornersOfMask(MaskOf(corners));
  const CellCorners listed = Relisted(FacesOf(slots), *pattern);
  CellCorners result;
  for (int i = 0; i < 8; ++i) result[i] = corners[listed[i]];
  return result;
}

}  // namespace amhex
