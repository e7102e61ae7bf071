// Abaqus and CalculiX input decks: nodes, elements and sets; no material, no step.
#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cells/boundary.h"
#include "formats/mesh_file.h"
#include "formats/solver_cells.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

constexpr std::array<std::pair<PrimitiveType, const char*>, 4> kAbaqusTypes = {
    {{PrimitiveType::kHexahedron, "C3D8"},
     {PrimitiveType::kPrism, "C3D6"},
     {PrimitiveType::kPyramid, "C3D8"},
     {PrimitiveType::kTetrahedron, "C3D4"}}};

// Eight nodes for a pyramid: the base is the first ring, the apex the whole second one. The
// trilinear shape functions of the collapsed cell are still linear along every edge and on its
// triangles, so that it fits its neighbours.
void Collapse(VtkCell* pyramid) {
  std::fill(pyramid->vertex.begin() + 5, pyramid->vertex.end(), pyramid->vertex[4]);
  pyramid->count = 8;
}

absl::StatusOr<std::string> HullNodes(const AtMostHexaMesh& mesh) {
  AMHEX_ASSIGN_OR_RETURN(const std::vector<BoundaryFace> boundary, BoundaryOf(mesh, {}));
  std::vector<bool> on_hull(mesh.vertices.size());
  for (const BoundaryFace& b : boundary) {
    for (int i = 0; i < b.face.count; ++i) on_hull[b.face.vertex[i]] = true;
  }
  std::string text = "*NSET, NSET=NHULL\n";
  constexpr int kPerLine = 16;  // the format's limit
  int count = 0;
  for (size_t i = 0; i < on_hull.size(); ++i) {
    if (on_hull[i]) absl::StrAppend(&text, i + 1, ++count % kPerLine == 0 ? ",\n" : ", ");
  }
  return text + "\n";
}

}  // namespace

absl::StatusOr<std::string> FormatAbaqus(const MeshDocument& document) {
  const AtMostHexaMesh& mesh = document.mesh;
  AMHEX_RETURN_IF_ERROR(CheckSolverReady(mesh, ".inp"));
  std::string text = "*HEADING\nat-most-hexa mesh\n*NODE, NSET=NALL\n";
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3d& v = mesh.vertices[i];
    absl::StrAppendFormat(&text, "%d, %.13g, %.13g, %.13g\n", i + 1, v.x, v.y, v.z);
  }
  size_t number = 0;
  for (const auto& [type, name] : kAbaqusTypes) {
    std::vector<VtkCell> cells = CellsOfType(mesh, type);
    if (cells.empty()) continue;
    absl::StrAppend(&text, "*ELEMENT, TYPE=", name, ", ELSET=EALL\n");
    for (VtkCell& cell : cells) {
      if (type == PrimitiveType::kPyramid) Collapse(&cell);
      absl::StrAppend(&text, ++number);
      for (int i = 0; i < cell.count; ++i) absl::StrAppend(&text, ", ", cell.vertex[i] + 1);
      text += "\n";
    }
  }
  AMHEX_ASSIGN_OR_RETURN(const std::string hull, HullNodes(mesh));
  return text + hull;
}

}  // namespace amhex::client
