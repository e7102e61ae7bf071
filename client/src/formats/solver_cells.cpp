#include "formats/solver_cells.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace amhex::client {

absl::Status CheckSolverReady(const AtMostHexaMesh& mesh, const std::string& format) {
  const auto count = [&](PrimitiveType type) {
    return std::count(mesh.types.begin(), mesh.types.end(), type);
  };
  const auto hexprisms = count(PrimitiveType::kHexprism), slices = count(PrimitiveType::kSlice);
  if (hexprisms + slices == 0) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(format, " has no word for the mesh's ",
                                                    hexprisms, " hexprisms and ", slices,
                                                    " slices; --solver-ready divides them"));
}

std::vector<VtkCell> CellsOfType(const AtMostHexaMesh& mesh, PrimitiveType type) {
  std::vector<VtkCell> cells;
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    if (mesh.types[cell] != type) continue;
    VtkCell vtk_cell = ToVtkCell(mesh.corners[cell]);
    if (type == PrimitiveType::kPrism) {
      std::swap(vtk_cell.vertex[1], vtk_cell.vertex[2]);
      std::swap(vtk_cell.vertex[4], vtk_cell.vertex[5]);
    }
    cells.push_back(vtk_cell);
  }
  return cells;
}

}  // namespace amhex::client
