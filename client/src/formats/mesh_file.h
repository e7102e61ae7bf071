// Files of volume meshes: .vtu (VTK XML) and .mesh (Medit).
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

enum class MeshFormat : uint8_t { kVtu, kMedit };

// By file extension, in any case.
std::optional<MeshFormat> MeshFormatOfPath(const std::string& path);
inline constexpr const char* kMeshExtensions = ".vtu, .mesh";

// A fact about the whole mesh, e.g. ("statistics.min_scaled_jacobian", 0.31).
struct MeshFact {
  std::string name;
  std::variant<double, std::string> value;
};

struct MeshDocument {
  AtMostHexaMesh mesh;
  std::vector<MeshFact> facts;  // .vtu only: field data
};

// .vtu: compressed binary. Hexahedra, prisms, pyramids and tetrahedra become VTK_HEXAHEDRON,
// VTK_WEDGE, VTK_PYRAMID and VTK_TETRA; the other two types VTK_HEXAHEDRON with repeated ids. Cell
// data: cell_type (the paper's number) and scaled_jacobian. Field data: the facts.
std::string FormatVtu(const MeshDocument& document);

// .mesh: Medit ascii; every cell a hexahedron, with repeated ids where it is less, its reference
// number the paper's cell type. 17 significant digits, so that reading gives back the same numbers.
std::string FormatMedit(const MeshDocument& document);

// Writes by extension. The file appears whole or not at all.
absl::Status WriteMeshFile(const MeshDocument& document, const std::string& path);

// Read what the writers above write, and files of others as far as they use the same features
// (.vtu: one piece, ascii or inline zlib arrays; .mesh: vertices, hexahedra, prisms, pyramids,
// tetrahedra). INVALID_ARGUMENT naming the line or array; types come from the cells' faces and
// quality from their geometry when the file does not say.
absl::StatusOr<MeshDocument> ReadVtu(std::string_view bytes);
absl::StatusOr<MeshDocument> ReadMedit(std::string_view bytes);
absl::StatusOr<MeshDocument> ReadMeshFile(const std::string& path);

}  // namespace amhex::client
