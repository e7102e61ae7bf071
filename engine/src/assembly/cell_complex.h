// A mesh under construction: positive cells that share faces, possibly with cavities between them.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "topology/primitives.h"

namespace amhex {

struct CellComplex {
  std::vector<Vec3d> vertices;     // [vertex_count] edge lengths (normalised frame)
  std::vector<CellCorners> cells;  // [cell_count], each recognised by RecognizeCell
  // Outward faces of cells that lie on the hull. A face of a cell that is neither shared with
  // another cell nor listed here is open: it borders a cavity.
  std::vector<CellFace> hull_faces;
};

}  // namespace amhex
