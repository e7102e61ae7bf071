#include "formats/mesh_completion.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "cells/cells.h"
#include "formats/status_macros.h"

namespace amhex::client {

absl::Status CompleteMesh(AtMostHexaMesh* mesh) {
  const bool has_quality = !mesh->quality.empty();
  mesh->types.clear();
  for (size_t cell = 0; cell < mesh->corners.size(); ++cell) {
    for (int32_t vertex : mesh->corners[cell]) {
      if (vertex >= 0 && static_cast<size_t>(vertex) < mesh->vertices.size()) continue;
      return absl::InvalidArgumentError(absl::StrCat("cell ", cell, " names vertex ", vertex,
                                                     ", but there are only ", mesh->vertices.size(),
                                                     " vertices (both counted from 0)"));
    }
    const std::optional<PrimitiveType> type = TypeOfCell(mesh->corners[cell]);
    if (!type) {
      return absl::InvalidArgumentError(
          absl::StrCat("cell ", cell, " is not one of the six cells of an at-most-hexa mesh"));
    }
    mesh->types.push_back(*type);
    if (!has_quality) {
      mesh->quality.push_back(
          static_cast<float>(ScaledJacobianOfCell(mesh->corners[cell], mesh->vertices)));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<AtMostHexaMesh> MeshOf(VolumeBuilder builder) {
  if (builder.hexahedra.size() != builder.mesh.cell_faces.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "cell ", builder.hexahedra.size(), " is not one of the six cells of an at-most-hexa mesh"));
  }
  AtMostHexaMesh mesh;
  mesh.vertices = std::move(builder.mesh.vertices);
  mesh.corners = std::move(builder.hexahedra);
  AMHEX_RETURN_IF_ERROR(CompleteMesh(&mesh));
  return mesh;
}

}  // namespace amhex::client
