// Faces and the edges that join them (face_complex.h) as plain arrays; usable where bodies run.
#pragma once

#include <array>
#include <cstdint>

#include "base/array_view.h"
#include "topology/primitives.h"

namespace amhex {

// Views do not own: the arrays must outlive them.
struct FaceComplexView {
  ArrayView<const CellFace> faces;
  ArrayView<const std::array<int32_t, 4>> edges_of_face;  // in ring order
  ArrayView<const int32_t> first;                         // [edge_count + 1] rows of the next
  ArrayView<const int32_t> faces_of_edge;                 // ascending in every row

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(faces), visit(edges_of_face), visit(first), visit(faces_of_edge);
  }
};

}  // namespace amhex
