#include "cells/mesh_check.h"

#include <array>
#include <cmath>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "cells/boundary.h"
#include "cells/cells.h"

namespace amhex::client {
namespace {

template <class... Parts>
absl::Status Broken(const Parts&... parts) {
  return absl::DataLossError(absl::StrCat("the mesh is not valid: ", parts...));
}

absl::Status CheckLengths(const AtMostHexaMesh& mesh) {
  if (mesh.corners.empty() || mesh.vertices.empty()) return Broken("it has no cell");
  if (mesh.types.size() != mesh.corners.size() || mesh.quality.size() != mesh.corners.size()) {
    return Broken(mesh.corners.size(), " cells, but ", mesh.types.size(), " types and ",
                  mesh.quality.size(), " qualities");
  }
  return absl::OkStatus();
}

absl::Status CheckVertices(const AtMostHexaMesh& mesh) {
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3d& v = mesh.vertices[i];
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) {
      return Broken("vertex ", i, " is not finite");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckCell(const AtMostHexaMesh& mesh, size_t cell) {
  for (int32_t vertex : mesh.corners[cell]) {
    if (vertex < 0 || static_cast<size_t>(vertex) >= mesh.vertices.size()) {
      return Broken("cell ", cell, " names vertex ", vertex, " of ", mesh.vertices.size());
    }
  }
  const std::optional<PrimitiveType> type = TypeOfCell(mesh.corners[cell]);
  if (!type) return Broken("cell ", cell, " has the faces of no known type");
  if (*type != mesh.types[cell]) {
    return Broken("cell ", cell, " is called ", PrimitiveName(mesh.types[cell]), ", but is a ",
                  PrimitiveName(*type));
  }
  const double volume = VolumeOfCell(mesh.corners[cell], mesh.vertices);
  if (!(volume > 0)) {
    return Broken("cell ", cell, " (", PrimitiveName(*type), ") has volume ", volume);
  }
  return absl::OkStatus();
}

absl::Status CheckClosed(const std::vector<BoundaryFace>& boundary) {
  // Net passages of each edge, counted up in one direction and down in the other.
  absl::flat_hash_map<std::array<int32_t, 2>, int> balance;
  for (const BoundaryFace& b : boundary) {
    for (int i = 0; i < b.face.count; ++i) {
      const int32_t from = b.face.vertex[i], to = b.face.vertex[(i + 1) % b.face.count];
      if (from < to) {
        ++balance[{from, to}];
      } else {
        --balance[{to, from}];
      }
    }
  }
  for (const auto& [edge, count] : balance) {
    if (count != 0) return Broken("the boundary is open at edge ", edge[0], " - ", edge[1]);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckMesh(const AtMostHexaMesh& mesh) {
  absl::Status status = CheckLengths(mesh);
  if (status.ok()) status = CheckVertices(mesh);
  for (size_t cell = 0; status.ok() && cell < mesh.corners.size(); ++cell) {
    status = CheckCell(mesh, cell);
  }
  if (!status.ok()) return status;
  const absl::StatusOr<std::vector<BoundaryFace>> boundary = BoundaryOf(mesh, {});
  if (!boundary.ok()) return Broken(std::string(boundary.status().message()));
  if (boundary->empty()) return Broken("it has no boundary");
  return CheckClosed(*boundary);
}

}  // namespace amhex::client
