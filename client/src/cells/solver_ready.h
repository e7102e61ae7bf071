// Meshes for solvers that know hexahedra, prisms, pyramids and tetrahedra only.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/volume_mesh.h"

namespace amhex::client {

// The same solid without hexprisms and slices, and still conforming: where a quadrilateral of a
// divided cell has to be split, the cell on its other side is divided too, with the same diagonal.
// That never goes on, as any cell can be divided around a new vertex inside it. Vertices keep
// their numbers and places, new ones follow; cells that need no division keep their corners.
//
// Which quadrilaterals are split is chosen by a search that weighs the worst cell against the
// number of cells divided. Deterministic.
//
// DATA_LOSS if the cells of `mesh` do not fit together; FAILED_PRECONDITION naming the cell if
// one cannot be divided into cells of positive scaled Jacobian.
// O(n) time and memory for n cells.
absl::StatusOr<AtMostHexaMesh> MakeSolverReady(const AtMostHexaMesh& mesh);

}  // namespace amhex::client
