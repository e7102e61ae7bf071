#include "topology/extract_topology.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "topology/direct_cells.h"

namespace amhex {
namespace {

absl::Status CheckShapes(const MergedCubes& cubes) {
  const size_t cube_count = cubes.corners.size();
  if (cubes.hull_faces.size() != cube_count) {
    return absl::InvalidArgumentError(absl::StrCat("hull_faces has ", cubes.hull_faces.size(),
                                                   " entries for ", cube_count, " cubes"));
  }
  const auto vertex_count = static_cast<int32_t>(cubes.vertices.size());
  for (size_t i = 0; i < cube_count; ++i) {
    for (const int32_t v : cubes.corners[i]) {
      if (v >= 0 && v < vertex_count) continue;
      return absl::InvalidArgumentError(absl::StrCat("corners[", i, "] names vertex ", v,
                                                     ", must be in [0, ", vertex_count, ")"));
    }
  }
  return absl::OkStatus();
}

std::vector<CellFace> AllFaces(const std::vector<Primitive>& primitives) {
  std::vector<CellFace> faces;
  faces.reserve(6 * primitives.size());
  for (const Primitive& primitive : primitives) {
    for (const CellFace& face : FacesOf(primitive.corners)) faces.push_back(face);
  }
  return faces;
}

}  // namespace

absl::StatusOr<PrimitiveTable> ExtractTopology(const MergedCubes& cubes,
                                               const MeshingParams& params, RunContext& context) {
  if (absl::Status status = CheckShapes(cubes); !status.ok()) return status;
  auto direct = FindDirectCells(cubes, params, context);
  if (!direct.ok()) return direct.status();
  PrimitiveTable table;
  table.primitives = *std::move(direct);
  table.initial_count = static_cast<int32_t>(table.primitives.size());
  table.faces =
      FaceTable::Build(static_cast<int32_t>(cubes.vertices.size()), AllFaces(table.primitives));
  for (Primitive& primitive : table.primitives) LookUpHalfFaces(table.faces, &primitive);
  table.on_hull = MarkHullFaces(cubes, table.faces);
  return table;
}

}  // namespace amhex
