// Files of volume meshes, and of the surfaces around them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/volume_mesh.h"

namespace amhex::client {

enum class MeshFormat : uint8_t { kVtu, kMedit, kVtk, kGmsh, kAbaqus, kFoam };

// By file extension, in any case; a folder named polyMesh is kFoam.
std::optional<MeshFormat> MeshFormatOfPath(const std::string& path);
// What ReadMeshFile reads.
inline constexpr const char* kMeshExtensions = ".vtu, .vtk, .mesh, .msh";
bool IsReadable(MeshFormat format);
// What WriteMeshFile writes.
inline constexpr const char* kMeshOutputExtensions =
    ".vtu .vtk .mesh .msh .inp, a folder polyMesh; the surface alone as .ply .obj .off .stl .drc";
bool IsWritableMeshPath(const std::string& path);

// A fact about the whole mesh, e.g. ("statistics.min_scaled_jacobian", 0.31).
struct MeshFact {
  std::string name;
  std::variant<double, std::string, std::vector<double>> value;
};

// The fact's number or numbers; none of a text.
std::vector<double> NumbersOf(const MeshFact& fact);
// The fact for people: a number with ten digits, a text as it is, a list by its length.
std::string TextOf(const MeshFact& fact);

// Files hold texts as the codes of their characters, with a zero at the end.
std::string TextOfCodes(const std::vector<double>& codes);

struct MeshDocument {
  AtMostHexaMesh mesh;
  std::vector<MeshFact> facts = {};  // .vtu and .vtk only: field data
  // .vtu and .vtk only: [cell_count] as measured by distance/hull_distance.h, NaN where there is
  // none; or empty when it was not measured.
  std::vector<float> distances = {};
};

// .vtu: compressed binary. Hexahedra, prisms, pyramids and tetrahedra become VTK_HEXAHEDRON,
// VTK_WEDGE, VTK_PYRAMID and VTK_TETRA; the other two types VTK_HEXAHEDRON with repeated ids. Cell
// data: cell_type (the paper's number), scaled_jacobian and, if known, distance_to_input. Field
// data: the facts.
std::string FormatVtu(const MeshDocument& document);

// .mesh: Medit ascii; every cell a hexahedron, with repeated ids where it is less, its reference
// number the paper's cell type. 17 significant digits, so that reading gives back the same numbers.
std::string FormatMedit(const MeshDocument& document);

// .vtk: VTK's legacy format, binary; cells, cell data and facts as in .vtu.
std::string FormatVtk(const MeshDocument& document);

// .msh: Gmsh 4.1 ascii, one volume in the physical group "solid". .inp: Abaqus and CalculiX, all
// nodes in the set NALL, all elements in EALL, and the nodes on the hull in NHULL; pyramids
// are C3D8 with their apex four times, as CalculiX has no word for them. Neither has one for
// hexprisms and slices: FAILED_PRECONDITION counting them (cells/solver_ready.h divides them).
absl::StatusOr<std::string> FormatGmsh(const MeshDocument& document);
absl::StatusOr<std::string> FormatAbaqus(const MeshDocument& document);

// OpenFOAM's polyMesh: points, faces, owner, neighbour, boundary, with the hull as one patch
// "hull". Faces are in the order that OpenFOAM wants. FAILED_PRECONDITION for slices, two faces of
// which share two edges; DATA_LOSS if the cells do not fit together.
struct FoamFile {
  std::string name, content;
};
absl::StatusOr<std::vector<FoamFile>> FormatFoam(const MeshDocument& document);

// Writes by extension; surface formats get the mesh's boundary (formats/boundary_surface.h). The
// file appears whole or not at all; of a polyMesh this holds for each file.
absl::Status WriteMeshFile(const MeshDocument& document, const std::string& path);

// Read what the writers above write, and files of others as far as they use the same features
// (.vtu: one piece, ascii or inline zlib arrays; .mesh: vertices, hexahedra, prisms, pyramids,
// tetrahedra; .vtk and .msh: as formats/volume_reader.h says, but for polyhedra and prisms of five
// and six sides). INVALID_ARGUMENT naming the line or array; types come from the cells' faces and
// quality from their geometry when the file does not say.
absl::StatusOr<MeshDocument> ReadVtu(std::string_view bytes);
absl::StatusOr<MeshDocument> ReadVtk(std::string_view bytes);
absl::StatusOr<MeshDocument> ReadMedit(std::string_view bytes);
absl::StatusOr<MeshDocument> ReadGmsh(std::string_view bytes);
// INVALID_ARGUMENT, too, for the formats that are written only.
absl::StatusOr<MeshDocument> ReadMeshFile(const std::string& path);

}  // namespace amhex::client
