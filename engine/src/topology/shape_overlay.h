// Corners of a primitive from its faces; usable where bodies run.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "topology/cell_face.h"
#include "topology/primitive_catalog.h"

namespace amhex {

inline constexpr int kMostFaces = 6;  // of any cell

// Where vertex `to` follows vertex `from` on the ring of a face.
struct RingPosition {
  int face = -1;
  int index = -1;
};

AMHEX_HD inline RingPosition FindDirectedEdge(const CellFace* faces, int count,
                                              const std::array<int32_t, 2>& edge) {
  for (int f = 0; f < count; ++f) {
    for (int i = 0; i < faces[f].count; ++i) {
      if (faces[f].v[i] == edge[0] && faces[f].v[(i + 1) % faces[f].count] == edge[1]) {
        return {f, i};
      }
    }
  }
  return {};
}

// Lays a shape's faces over given ones. Fixing how one face lies fixes all others, because both
// surfaces are closed and have every directed edge once.
class ShapeOverlay {
 public:
  // Both must outlive this.
  AMHEX_HD ShapeOverlay(const PrimitiveShape& shape, const CellFaces& faces)
      : shape_(shape), faces_(faces) {}

  // Whether the faces form the shape; then `corners` are set.
  AMHEX_HD bool Find(CellCorners& corners) {
    if (faces_.count != shape_.face_count()) return false;
    for (int f = 0; f < faces_.count; ++f) {
      for (int i = 0; i < faces_.face[f].count; ++i) {
        if (!Try({f, i})) continue;
        for (int slot = 0; slot < 8; ++slot) corners[slot] = vertex_[shape_.pattern[slot]];
        return true;
      }
    }
    return false;
  }

 private:
  // Lays the shape's first face over a face so that its corner 0 meets the corner of that index,
  // then the neighbours of all faces that lie.
  AMHEX_HD bool Try(const RingPosition& start) {
    for (int v = 0; v < 8; ++v) vertex_[v] = -1;
    for (int f = 0; f < kMostFaces; ++f) is_laid_[f] = false;
    laid_count_ = 0;
    if (!Lay(0, start)) return false;
    for (int next = 0; next < laid_count_; ++next) {
      if (!LayNeighbours(shape_.faces[laid_[next]])) return false;
    }
    return true;
  }

  AMHEX_HD bool Lay(int shape_face, const RingPosition& position) {
    const CellFace& from = shape_.faces[shape_face];
    const CellFace& to = faces_.face[position.face];
    if (from.count != to.count) return false;
    is_laid_[shape_face] = true;
    laid_[laid_count_++] = shape_face;
    for (int i = 0; i < from.count; ++i) {
      if (!SetVertex(from.v[i], to.v[(position.index + i) % to.count])) return false;
    }
    return true;
  }

  AMHEX_HD bool LayNeighbours(const CellFace& from) {
    for (int i = 0; i < from.count; ++i) {
      const int32_t a = from.v[i], b = from.v[(i + 1) % from.count];
      const RingPosition in_shape =
          FindDirectedEdge(shape_.faces.data(), shape_.face_count(), {b, a});
      RingPosition in_faces =
          FindDirectedEdge(faces_.face.data(), faces_.count, {vertex_[b], vertex_[a]});
      if (in_faces.face < 0) return false;
      if (is_laid_[in_shape.face]) continue;
      const int count = faces_.face[in_faces.face].count;
      in_faces.index = (in_faces.index + count - in_shape.index % count) % count;
      if (!Lay(in_shape.face, in_faces)) return false;
    }
    return true;
  }

  AMHEX_HD bool SetVertex(int32_t shape_vertex, int32_t vertex) {
    if (vertex_[shape_vertex] == vertex) return true;
    if (vertex_[shape_vertex] != -1) return false;
    for (const int32_t other : vertex_) {
      if (other == vertex) return false;
    }
    vertex_[shape_vertex] = vertex;
    return true;
  }

  const PrimitiveShape& shape_;
  const CellFaces& faces_;
  std::array<int32_t, 8> vertex_{};
  std::array<bool, kMostFaces> is_laid_{};
  std::array<int, kMostFaces> laid_{};
  int laid_count_ = 0;
};

// The corners of the same primitive seen from the other side, or as they are if they are none.
AMHEX_HD inline CellCorners Mirrored(const PrimitiveShape& shape, const CellCorners& corners) {
  CellFaces faces = CollapsedFaces(corners);
  for (int f = 0; f < faces.count; ++f) faces.face[f] = BackwardsFromSmallest(faces.face[f]);
  CellCorners mirrored;
  return ShapeOverlay(shape, faces).Find(mirrored) ? mirrored : corners;
}

}  // namespace amhex
