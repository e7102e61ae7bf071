// Gmsh 4.1, ascii.
#include <array>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "formats/mesh_file.h"
#include "formats/solver_cells.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

constexpr int kVolume = 1;         // the tag of the only entity
constexpr int kPhysicalSolid = 1;  // and of the only physical group

// Gmsh's numbers of element types.
constexpr std::array<std::pair<PrimitiveType, int>, 4> kGmshTypes = {
    {{PrimitiveType::kHexahedron, 5},
     {PrimitiveType::kPrism, 6},
     {PrimitiveType::kPyramid, 7},
     {PrimitiveType::kTetrahedron, 4}}};

std::string Entities(const AtMostHexaMesh& mesh) {
  Box3d box;
  for (const Vec3d& v : mesh.vertices) box.Extend(v);
  return absl::StrFormat(
      "$Entities\n0 0 0 1\n%d %.17g %.17g %.17g %.17g %.17g %.17g 1 %d 0\n$EndEntities\n", kVolume,
      box.low.x, box.low.y, box.low.z, box.high.x, box.high.y, box.high.z, kPhysicalSolid);
}

}  // namespace

absl::StatusOr<std::string> FormatGmsh(const MeshDocument& document) {
  const AtMostHexaMesh& mesh = document.mesh;
  AMHEX_RETURN_IF_ERROR(CheckSolverReady(mesh, ".msh"));
  std::string text =
      absl::StrCat("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 ", kPhysicalSolid,
                   " \"solid\"\n$EndPhysicalNames\n", Entities(mesh));
  const size_t vertices = mesh.vertices.size(), cells = mesh.corners.size();
  absl::StrAppend(&text, "$Nodes\n1 ", vertices, " 1 ", vertices, "\n3 ", kVolume, " 0 ", vertices,
                  "\n");
  for (size_t i = 1; i <= vertices; ++i) absl::StrAppend(&text, i, "\n");
  for (const Vec3d& v : mesh.vertices) {
    absl::StrAppendFormat(&text, "%.17g %.17g %.17g\n", v.x, v.y, v.z);
  }
  std::string blocks;
  int block_count = 0;
  size_t tag = 0;
  for (const auto& [type, number] : kGmshTypes) {
    const std::vector<VtkCell> listed = CellsOfType(mesh, type);
    if (listed.empty()) continue;
    ++block_count;
    absl::StrAppend(&blocks, "3 ", kVolume, " ", number, " ", listed.size(), "\n");
    for (const VtkCell& cell : listed) {
      absl::StrAppend(&blocks, ++tag);
      for (int i = 0; i < cell.count; ++i) absl::StrAppend(&blocks, " ", cell.vertex[i] + 1);
      blocks += "\n";
    }
  }
  absl::StrAppend(&text, "$EndNodes\n$Elements\n", block_count, " ", cells, " 1 ", cells, "\n",
                  blocks, "$EndElements\n");
  return text;
}

}  // namespace amhex::client
