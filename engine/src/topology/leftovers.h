// What the direct cells leave over: where the graph search has something to find.
//
// Not in the paper, which searches all faces. A half-face of a direct cell is in one of three
// states: matched by another direct cell, part of the hull, or open; only the open ones and the
// cubes that became no cell need the search.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/merged_cubes.h"
#include "topology/primitive_table.h"

namespace amhex {

class Leftovers {
 public:
  // `direct` holds the direct cells with their half-faces; it must outlive this.
  Leftovers(const MergedCubes& cubes, const PrimitiveTable& direct);

  bool IsEmpty() const { return region_.empty(); }

  // [vertex_count] 1 for the vertices of cubes that are no direct cells, of open half-faces, and
  // of half-faces that two direct cells claim; empty if there is none.
  const std::vector<uint8_t>& region() const { return region_; }

  // The direct cells' faces that are not settled: open or claimed twice.
  std::vector<CellFace> UnsettledFaces() const;

  // True if both sides of the face are used, or it is used and the hull lies behind it.
  bool IsSettled(const CellFace& face) const;

  // True if the primitive could join the direct cells: it uses no half-face of theirs, does not
  // lie outside a hull face, and closes at least `min_closed` open faces.
  bool Fits(const CellCorners& corners, int min_closed) const;

 private:
  bool IsUsed(HalfFaceId half_face) const { return claims_[half_face] > 0; }
  bool IsSettledFace(int32_t face) const;

  const PrimitiveTable& direct_;
  std::vector<uint8_t> claims_;  // [half_face_count] by how many direct cells, 2 = two or more
  std::vector<uint8_t> region_;
};

}  // namespace amhex
