// Every triangle and quad once, with ids for its two sides. Section 5.2, I.
#pragma once

#include <cstdint>
#include <vector>

#include "topology/half_face.h"

namespace amhex {

// 2 * face + side; side 0 is the direction the table stores, side 1 its opposite.
using HalfFaceId = int32_t;
inline constexpr HalfFaceId kNoHalfFace = -1;

inline HalfFaceId OppositeOf(HalfFaceId half_face) { return half_face ^ 1; }
inline int32_t FaceOf(HalfFaceId half_face) { return half_face >> 1; }

// Immutable. Two quads over the same four vertices in another cyclic order are two faces.
class FaceTable {
 public:
  FaceTable() = default;

  // Keeps one entry per face however often and from whichever side it is given; `faces` in any
  // order, ids in [0, vertex_count). The result depends on the set of faces only. Linear time.
  static FaceTable Build(int32_t vertex_count, const std::vector<CellFace>& faces);

  int32_t count() const { return static_cast<int32_t>(faces_.size()); }
  int32_t half_face_count() const { return 2 * count(); }

  // Ascending; stored in the direction that stands for the face.
  const CellFace& face(int32_t index) const { return faces_[index]; }
  CellFace half_face(HalfFaceId id) const;

  // The id of that half-face, or kNoHalfFace. Looks through the faces whose smallest vertex is
  // the same, a few dozen at most.
  HalfFaceId Find(const CellFace& half_face) const;

 private:
  std::vector<CellFace> faces_;
  std::vector<int32_t> first_face_;  // [vertex_count + 1] of each smallest vertex
};

}  // namespace amhex
