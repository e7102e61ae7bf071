// The voids between cells: open faces grouped so that each group bounds one cavity.
#pragma once

#include <vector>

#include "closure/working_mesh.h"

namespace amhex {

struct Cavities {
  // [cavity] its open faces, outward of their cells, that is, looking into the void.
  std::vector<std::vector<CellFace>> faces;
  std::vector<int32_t> of_half_face;  // [half_face] cavity of an open half-face, else -1

  int count() const { return static_cast<int>(faces.size()); }
  int Of(int half_face) const {
    return half_face >= 0 && half_face < static_cast<int>(of_half_face.size())
               ? of_half_face[half_face]
               : -1;
  }
};

// Faces that share an edge belong together; where more than two meet, those that face each other
// across the narrowest void do, so that networks of slits fall apart into small cavities.
Cavities CollectCavities(const WorkingMesh& mesh);

// Directed edges of `faces` that no other face takes back, traced into loops and reversed: the
// boundary that a patch must have to close the faces. Empty inner loop = not traceable.
std::vector<std::vector<int32_t>> BoundaryLoops(const std::vector<CellFace>& faces);

}  // namespace amhex
