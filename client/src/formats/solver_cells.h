// The four kinds of cells that solvers know, each kind by itself.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "amhex/volume_mesh.h"
#include "formats/vtk_cells.h"

namespace amhex::client {

// FAILED_PRECONDITION counting the hexprisms and slices, if there are any, and naming `format`.
absl::Status CheckSolverReady(const AtMostHexaMesh& mesh, const std::string& format);

// The cells of one type in the order in which Gmsh, Abaqus and Medit list vertices: that of VTK,
// but for prisms, whose first triangle is counter-clockwise seen from the second.
std::vector<VtkCell> CellsOfType(const AtMostHexaMesh& mesh, PrimitiveType type);

}  // namespace amhex::client
