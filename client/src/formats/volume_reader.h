// Reads volume meshes of others as input: .vtk .msh .vtu .mesh.
//
// As with the surface readers, bytes may come from anywhere: counts are checked against the bytes
// present before memory is reserved, and errors name the line or the cell.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"

namespace amhex::client {

enum class VolumeFormat : uint8_t { kVtk, kGmsh, kVtu, kMedit };

// By file extension, in any case; nullopt for every other extension.
std::optional<VolumeFormat> VolumeFormatOfPath(const std::string& path);
inline constexpr const char* kVolumeExtensions = ".vtk, .msh, .vtu, .mesh";

// Cells of two and fewer dimensions are skipped. Errors begin with the path and are
// INVALID_ARGUMENT for anything wrong with the contents.
absl::StatusOr<VolumeMesh> ReadVolumeFile(const std::string& path);

// The formats one by one; messages do not name the file.
// VTK's legacy unstructured grids, ascii and binary, up to version 5.1: tetrahedra, voxels,
// hexahedra, wedges, pyramids, polyhedra, pentagonal and hexagonal prisms.
absl::StatusOr<VolumeMesh> ReadVtkVolume(std::string_view bytes);
// Gmsh 2.2 and 4.1, ascii: first-order tetrahedra, hexahedra, prisms and pyramids.
absl::StatusOr<VolumeMesh> ReadGmshVolume(std::string_view bytes);
// VTK XML as far as ReadVtu (formats/mesh_file.h) reads it, with the cells of ReadVtkVolume.
absl::StatusOr<VolumeMesh> ReadVtuVolume(std::string_view bytes);
// As far as ReadMedit reads it.
absl::StatusOr<VolumeMesh> ReadMeditVolume(std::string_view bytes);

}  // namespace amhex::client
