#include "reassembly/polyhedron.h"

#include <algorithm>
#include <array>

#include "topology/primitive_catalog.h"

namespace amhex {
namespace {

struct FaceEdge {
  std::array<int32_t, 2> ends;  // the smaller vertex first
  int32_t face;
  bool runs_up;  // from the smaller vertex to the larger one

  friend bool operator<(const FaceEdge& a, const FaceEdge& b) {
    return a.ends != b.ends ? a.ends < b.ends : a.face < b.face;
  }
};

std::vector<FaceEdge> SortedEdges(const std::vector<Polygon>& faces) {
  std::vector<FaceEdge> edges;
  for (size_t f = 0; f < faces.size(); ++f) {
    const Polygon& face = faces[f];
    for (size_t i = 0; i < face.size(); ++i) {
      const int32_t a = face[i], b = face[(i + 1) % face.size()];
      edges.push_back({{std::min(a, b), std::max(a, b)}, static_cast<int32_t>(f), a < b});
    }
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

// [face] 1 = to be turned; empty if the faces do not close.
std::vector<int8_t> FindTurns(const std::vector<FaceEdge>& edges, size_t face_count) {
  if (edges.size() % 2 != 0) return {};
  struct Link {
    int32_t face;
    bool agrees;
  };
  std::vector<std::vector<Link>> links(face_count);
  for (size_t i = 0; i < edges.size(); i += 2) {
    const FaceEdge &a = edges[i], &b = edges[i + 1];
    const bool is_third = i + 2 < edges.size() && edges[i + 2].ends == a.ends;
    if (a.ends != b.ends || is_third || a.face == b.face || a.ends[0] == a.ends[1]) return {};
    const bool agrees = a.runs_up != b.runs_up;
    links[static_cast<size_t>(a.face)].push_back({b.face, agrees});
    links[static_cast<size_t>(b.face)].push_back({a.face, agrees});
  }
  std::vector<int8_t> turn(face_count, -1);
  std::vector<int32_t> queue = {0};
  turn[0] = 0;
  for (size_t head = 0; head < queue.size(); ++head) {
    const auto from = static_cast<size_t>(queue[head]);
    for (const Link& link : links[from]) {
      const auto wanted = static_cast<int8_t>(link.agrees ? turn[from] : 1 - turn[from]);
      int8_t& known = turn[static_cast<size_t>(link.face)];
      if (known < 0) {
        known = wanted;
        queue.push_back(link.face);
      } else if (known != wanted) {
        return {};
      }
    }
  }
  if (queue.size() != face_count) return {};
  return turn;
}

// Six times, about the first vertex.
double SignedVolume(const std::vector<Vec3d>& vertices, const std::vector<Polygon>& faces) {
  const Vec3d origin = vertices[static_cast<size_t>(faces[0][0])];
  double volume = 0;
  for (const Polygon& face : faces) {
    const Vec3d a = vertices[static_cast<size_t>(face[0])] - origin;
    for (size_t i = 1; i + 1 < face.size(); ++i) {
      volume += Determinant(a, vertices[static_cast<size_t>(face[i])] - origin,
                            vertices[static_cast<size_t>(face[i + 1])] - origin);
    }
  }
  return volume;
}

}  // namespace

bool OrientOutward(const std::vector<Vec3d>& vertices, std::vector<Polygon>* faces) {
  const std::vector<int8_t> turn = FindTurns(SortedEdges(*faces), faces->size());
  if (turn.empty()) return false;
  for (size_t f = 0; f < faces->size(); ++f) {
    if (turn[f] == 1) std::reverse((*faces)[f].begin(), (*faces)[f].end());
  }
  if (SignedVolume(vertices, *faces) < 0) {
    for (Polygon& face : *faces) std::reverse(face.begin(), face.end());
  }
  return true;
}

std::optional<CellCorners> CellOfFaces(const std::vector<Polygon>& faces) {
  std::array<CellFace, 6> cell_faces;
  if (faces.size() > cell_faces.size()) return std::nullopt;
  int quads = 0, triangles = 0;
  for (size_t f = 0; f < faces.size(); ++f) {
    if (faces[f].size() > 4) return std::nullopt;
    (faces[f].size() == 4 ? quads : triangles) += 1;
    cell_faces[f].count = static_cast<int>(faces[f].size());
    std::copy(faces[f].begin(), faces[f].end(), cell_faces[f].v.begin());
  }
  for (const PrimitiveType type : kPrimitiveTypes) {
    const PrimitiveShape& shape = ShapeOf(type);
    if (shape.quad_count != quads || shape.triangle_count != triangles) continue;
    const auto corners = CornersFromFaces(type, {cell_faces.data(), faces.size()});
    if (corners.has_value()) return corners;
  }
  return std::nullopt;
}

void CutPolygon(const Polygon& polygon, std::vector<CellFace>* pieces) {
  if (polygon.size() <= 4) {
    CellFace face;
    face.count = static_cast<int>(polygon.size());
    std::copy(polygon.begin(), polygon.end(), face.v.begin());
    pieces->push_back(face);
    return;
  }
  Polygon ring = polygon;
  std::rotate(ring.begin(), std::min_element(ring.begin(), ring.end()), ring.end());
  for (size_t i = 1; i + 1 < ring.size(); ++i) {
    pieces->push_back(Triangle(ring[0], ring[i], ring[i + 1]));
  }
}

}  // namespace amhex
