// What the initial mesh leaves over: where the graph search has something to find.
//
// Not in the paper, which searches all faces. A half-face of an initial cell is in one of three
// states: matched by another initial cell, part of the hull, or open; only the open ones and the
// cubes that are not in the initial mesh need the search.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/merged_cubes.h"
#include "topology/primitive_table.h"

namespace amhex {

class Leftovers {
 public:
  // `initial` holds the initial cells only, with their half-faces; it must outlive this.
  Leftovers(const MergedCubes& cubes, const PrimitiveTable& initial);

  bool IsEmpty() const { return region_.empty(); }

  // [vertex_count] 1 for the vertices of cubes that are no initial cells, of open half-faces, and
  // of half-faces that two initial cells claim; empty if there is none.
  const std::vector<uint8_t>& region() const { return region_; }

  // The initial cells' faces that are not settled: open or claimed twice.
  std::vector<CellFace> UnsettledFaces() const;

  // True if both sides of the face are used, or it is used and the hull lies behind it.
  bool IsSettled(const CellFace& face) const;

  // True if the primitive could join the initial cells: it uses no half-face of theirs and does
  // not lie outside a hull face.
  bool Fits(const CellCorners& corners) const;

 private:
  bool IsUsed(HalfFaceId half_face) const { return claims_[half_face] > 0; }
  bool IsSettledFace(int32_t face) const;

  const PrimitiveTable& initial_;
  std::vector<uint8_t> claims_;  // [half_face_count] by how many initial cells, 2 = two or more
  std::vector<uint8_t> region_;
};

}  // namespace amhex
