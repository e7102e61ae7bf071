#include "topology/primitives.h"

#include <algorithm>
#include <cmath>

#include "topology/cell_face.h"
#include "topology/trilinear_volume.h"

namespace amhex {
namespace {

bool HasEightVertices(const CellCorners& corners) {
  for (int i = 1; i < 8; ++i) {
    for (int j = 0; j < i; ++j) {
      if (corners[i] == corners[j]) return false;
    }
  }
  return true;
}

// Directed edges of a cell's faces; a proper closed surface has each once and its reverse once.
struct DirectedEdges {
  int count = 0;
  std::array<std::array<int32_t, 2>, 24> edge;

  bool Contains(int32_t from, int32_t to) const {
    for (int i = 0; i < count; ++i) {
      if (edge[i][0] == from && edge[i][1] == to) return true;
    }
    return false;
  }
  int CountFrom(int32_t from) const {
    int found = 0;
    for (int i = 0; i < count; ++i) found += edge[i][0] == from ? 1 : 0;
    return found;
  }
  bool InsertUnique(int32_t from, int32_t to) {
    if (Contains(from, to)) return false;
    edge[count++] = {from, to};
    return true;
  }
};

// The edges around one vertex of a cell: for each incident face its next and previous vertex.
struct VertexFan {
  int count = 0;
  std::array<int32_t, 6> next{}, previous{};
};

VertexFan FanAround(int32_t vertex, const CellFaces& faces) {
  VertexFan fan;
  for (const CellFace& face : faces) {
    for (int j = 0; j < face.count; ++j) {
      if (face.v[j] != vertex) continue;
      fan.next[fan.count] = face.v[(j + 1) % face.count];
      fan.previous[fan.count] = face.v[(j + face.count - 1) % face.count];
      ++fan.count;
    }
  }
  return fan;
}

double CornerJacobian(const VertexFan& fan, const Vec3d& at, const std::vector<Vec3d>& vertices) {
  const int32_t a = fan.next[0];
  const int32_t b = fan.previous[0];
  int32_t c = -1;
  for (int j = 0; j < 3; ++j) {
    if (fan.next[j] == b) c = fan.previous[j];
  }
  if (c < 0) return -1.0;
  const Vec3d ea = Normalized(vertices[a] - at);
  const Vec3d eb = Normalized(vertices[b] - at);
  const Vec3d ec = Normalized(vertices[c] - at);
  return -Determinant(ea, eb, ec);
}

}  // namespace

CellFaces FacesOf(const CellCorners& corners) { return CollapsedFaces(corners); }

CellFace FaceInDirection(const CellCorners& corners, int direction) {
  return CollapsedFace(corners, direction);
}

CellVertices VerticesOf(const CellCorners& corners) {
  CellVertices vertices;
  for (const int32_t v : corners) {
    if (std::find(vertices.begin(), vertices.end(), v) == vertices.end()) {
      vertices.v[vertices.count++] = v;
    }
  }
  return vertices;
}

std::optional<PrimitiveType> RecognizeCell(const CellCorners& corners) {
  if (HasEightVertices(corners)) return PrimitiveType::kHexahedron;  // nothing is collapsed
  const CellVertices vertices = VerticesOf(corners);
  const CellFaces faces = FacesOf(corners);
  int quads = 0, triangles = 0;
  DirectedEdges edges;
  for (const CellFace& face : faces) {
    (face.count == 4 ? quads : triangles) += 1;
    for (int j = 0; j < face.count; ++j) {
      if (!edges.InsertUnique(face.v[j], face.v[(j + 1) % face.count])) return std::nullopt;
    }
  }
  for (int i = 0; i < edges.count; ++i) {
    if (!edges.Contains(edges.edge[i][1], edges.edge[i][0])) return std::nullopt;
  }
  // Euler's formula rules out surfaces that touch themselves.
  if (vertices.count - edges.count / 2 + faces.count != 2) return std::nullopt;
  // Collapsing a corner of a face besides its edges gives the counts of a prism or a pyramid too,
  // but not the number of edges at every vertex.
  int with_two_edges = 0, with_four_edges = 0;
  for (const int32_t v : vertices) {
    const int degree = edges.CountFrom(v);
    with_two_edges += degree == 2 ? 1 : 0;
    with_four_edges += degree == 4 ? 1 : 0;
    if (degree < 2 || degree > 4) return std::nullopt;
  }
  struct Signature {
    int vertices, quads, triangles, with_two_edges, with_four_edges;
    PrimitiveType type;
  };
  static constexpr std::array<Signature, 6> kSignatures = {{
      {8, 6, 0, 0, 0, PrimitiveType::kHexahedron},
      {7, 4, 2, 0, 1, PrimitiveType::kHexprism},
      {6, 3, 2, 0, 0, PrimitiveType::kPrism},
      {5, 2, 2, 1, 0, PrimitiveType::kSlice},
      {5, 1, 4, 0, 1, PrimitiveType::kPyramid},
      {4, 0, 4, 0, 0, PrimitiveType::kTetrahedron},
  }};
  for (const Signature& s : kSignatures) {
    if (s.vertices == vertices.count && s.quads == quads && s.triangles == triangles &&
        s.with_two_edges == with_two_edges && s.with_four_edges == with_four_edges) {
      return s.type;
    }
  }
  return std::nullopt;
}

CellCorners MakeTetrahedron(int32_t v0, int32_t v1, int32_t v2, int32_t v3) {
  return {v0, v1, v1, v2, v0, v3, v3, v2};
}

CellCorners MakeTetrahedronOn(const std::array<int32_t, 3>& b, int32_t apex) {
  // The pattern's faces are 021 032 130 123 on (v0 v1 v2 v3): 0-2-1 is the outward base.
  return MakeTetrahedron(b[0], b[2], b[1], apex);
}

CellCorners MakePyramid(const std::array<int32_t, 4>& b, int32_t apex) {
  // Form a, 0 1 1 2 0 3 3 4: apex 0, outward base 1 2 4 3.
  const int32_t v1 = b[0], v2 = b[1], v4 = b[2], v3 = b[3];
  return {apex, v1, v1, v2, apex, v3, v3, v4};
}

double ScaledJacobian(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  const CellFaces faces = FacesOf(corners);
  double minimum = 1.0;
  for (const int32_t v : VerticesOf(corners)) {
    const VertexFan fan = FanAround(v, faces);
    if (fan.count != 3) continue;
    minimum = std::min(minimum, CornerJacobian(fan, vertices[v], vertices));
  }
  return minimum;
}

double CellVolume(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  std::array<Vec3d, 8> positions;
  for (int i = 0; i < 8; ++i) positions[i] = vertices[corners[i]];
  return TrilinearVolume(positions);
}

bool IsStarShaped(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  const CellVertices ids = VerticesOf(corners);
  Vec3d centre;
  for (const int32_t v : ids) centre += vertices[v];
  centre /= ids.count;
  for (const CellFace& face : FacesOf(corners)) {
    const int triangles = face.count == 3 ? 1 : 4;
    for (int j = 0; j < triangles; ++j) {
      const Vec3d a = vertices[face.v[j]] - centre;
      const Vec3d b = vertices[face.v[(j + 1) % face.count]] - centre;
      const Vec3d c = vertices[face.v[(j + 2) % face.count]] - centre;
      if (Determinant(a, b, c) <= 0) return false;
    }
  }
  return true;
}

}  // namespace amhex
