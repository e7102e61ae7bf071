#include "topology/primitive_catalog.h"

#include <algorithm>

namespace amhex {
namespace {

// Where vertex `to` follows vertex `from` on the ring of a face.
struct RingPosition {
  int face = -1;
  int index = -1;
};

RingPosition FindDirectedEdge(std::span<const CellFace> faces, int32_t from, int32_t to) {
  for (int f = 0; f < static_cast<int>(faces.size()); ++f) {
    for (int i = 0; i < faces[f].count; ++i) {
      if (faces[f].v[i] == from && faces[f].v[(i + 1) % faces[f].count] == to) return {f, i};
    }
  }
  return {};
}

// Lays the shape's faces over the given ones. Fixing how one face lies fixes all others, because
// both surfaces are closed and have every directed edge once.
class Overlay {
 public:
  Overlay(const PrimitiveShape& shape, std::span<const CellFace> faces)
      : shape_(shape), faces_(faces) {}

  // Lays the shape's first face over faces[face] so that its corner 0 meets corner `index`.
  std::optional<CellCorners> Try(int face, int index) {
    vertex_.fill(-1);
    is_laid_.fill(false);
    if (!Lay(0, {face, index})) return std::nullopt;
    CellCorners corners;
    for (int i = 0; i < 8; ++i) corners[i] = vertex_[shape_.pattern[i]];
    return corners;
  }

 private:
  bool Lay(int shape_face, RingPosition position) {
    const CellFace& from = shape_.faces[shape_face];
    if (position.face < 0) return false;
    const CellFace& to = faces_[position.face];
    if (from.count != to.count) return false;
    is_laid_[shape_face] = true;
    for (int i = 0; i < from.count; ++i) {
      if (!SetVertex(from.v[i], to.v[(position.index + i) % to.count])) return false;
    }
    return LayNeighbours(from);
  }

  bool LayNeighbours(const CellFace& from) {
    const std::span<const CellFace> shape_faces(shape_.faces.data(), shape_.face_count());
    for (int i = 0; i < from.count; ++i) {
      const int32_t a = from.v[i], b = from.v[(i + 1) % from.count];
      const RingPosition in_shape = FindDirectedEdge(shape_faces, b, a);
      RingPosition in_faces = FindDirectedEdge(faces_, vertex_[b], vertex_[a]);
      if (in_faces.face < 0) return false;
      if (is_laid_[in_shape.face]) continue;
      const int count = faces_[in_faces.face].count;
      in_faces.index = (in_faces.index + count - in_shape.index % count) % count;
      if (!Lay(in_shape.face, in_faces)) return false;
    }
    return true;
  }

  bool SetVertex(int32_t shape_vertex, int32_t vertex) {
    if (vertex_[shape_vertex] == vertex) return true;
    if (vertex_[shape_vertex] != -1) return false;
    if (std::find(vertex_.begin(), vertex_.end(), vertex) != vertex_.end()) return false;
    vertex_[shape_vertex] = vertex;
    return true;
  }

  const PrimitiveShape& shape_;
  std::span<const CellFace> faces_;
  std::array<int32_t, 8> vertex_{};
  std::array<bool, 6> is_laid_{};
};

}  // namespace

const PrimitiveShape& ShapeOf(PrimitiveType type) {
  return *std::find_if(kPrimitiveCatalog.begin(), kPrimitiveCatalog.end(),
                       [type](const PrimitiveShape& shape) { return shape.type == type; });
}

std::optional<CellCorners> CornersFromFaces(PrimitiveType type, std::span<const CellFace> faces) {
  const PrimitiveShape& shape = ShapeOf(type);
  if (static_cast<int>(faces.size()) != shape.face_count()) return std::nullopt;
  Overlay overlay(shape, faces);
  for (int f = 0; f < static_cast<int>(faces.size()); ++f) {
    for (int i = 0; i < faces[f].count; ++i) {
      if (auto corners = overlay.Try(f, i); corners.has_value()) return corners;
    }
  }
  return std::nullopt;
}

}  // namespace amhex
