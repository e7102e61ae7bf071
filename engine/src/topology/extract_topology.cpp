#include "topology/extract_topology.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "optimize/cell_quality.h"
#include "topology/collect_faces.h"
#include "topology/direct_cells.h"
#include "topology/face_complex.h"
#include "topology/leftovers.h"
#include "topology/primitive_search.h"

namespace amhex {
namespace {

// Hexahedra above this scaled Jacobian start the mesh; section 5.2, III.
constexpr double kInitialQuality = 0.5;
// Listing 3 never goes below two closed faces, so others need not be kept.
constexpr int kFewestClosedFaces = 2;

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

// Builds the face table of the primitives and marks the hull.
void IndexFaces(const MergedCubes& cubes, PrimitiveTable* table) {
  std::vector<CellFace> faces;
  faces.reserve(6 * table->primitives.size());
  for (const Primitive& primitive : table->primitives) {
    for (const CellFace& face : FacesOf(primitive.corners)) faces.push_back(face);
  }
  table->faces = FaceTable::Build(static_cast<int32_t>(cubes.vertices.size()), faces);
  for (Primitive& primitive : table->primitives) LookUpHalfFaces(table->faces, &primitive);
  table->on_hull = MarkHullFaces(cubes, table->faces);
}

// The found primitive the right way round, or nullopt if it is not good enough either way.
std::optional<Primitive> Judge(const FoundPrimitive& found, const std::vector<Vec3d>& vertices,
                               double min_quality) {
  Primitive primitive;
  primitive.type = found.type;
  primitive.corners = found.corners;
  if (CellVolume(found.corners, vertices) < 0) {
    primitive.corners = MirrorCorners(found.type, found.corners);
  }
  primitive.quality = CellQuality(primitive.corners, vertices);
  if (!(primitive.quality > min_quality)) return std::nullopt;
  return primitive;
}

// Listing 1: all good primitives among the faces, hexahedra first.
absl::StatusOr<std::vector<Primitive>> SearchAll(const FaceComplex& complex,
                                                 const std::vector<Vec3d>& vertices,
                                                 double min_quality, RunContext& context) {
  std::vector<Primitive> primitives;
  Progress progress = context.progress();
  for (size_t i = 0; i < kPrimitiveTypes.size(); ++i) {
    std::vector<FoundPrimitive> found;
    if (absl::Status status = FindPrimitives(complex, kPrimitiveTypes[i], context, &found);
        !status.ok()) {
      return status;
    }
    for (const FoundPrimitive& candidate : found) {
      if (auto primitive = Judge(candidate, vertices, min_quality)) {
        primitives.push_back(*primitive);
      }
    }
    progress.stage_fraction = double(i + 1) / kPrimitiveTypes.size();
    context.Report(progress);
  }
  return primitives;
}

// The default: direct cells first, then the search among what they leave over.
absl::StatusOr<PrimitiveTable> ExtractDirect(const MergedCubes& cubes, const MeshingParams& params,
                                             RunContext& context) {
  auto direct = FindDirectCells(cubes, params, context);
  if (!direct.ok()) return direct.status();
  PrimitiveTable table;
  table.primitives = *std::move(direct);
  table.initial_count = static_cast<int32_t>(table.primitives.size());
  IndexFaces(cubes, &table);
  const Leftovers leftovers(cubes, table);
  if (leftovers.IsEmpty()) return table;

  auto loops = CollectFaces(cubes.vertices, CollectCubeEdges(cubes, leftovers.region()), context);
  if (!loops.ok()) return loops.status();
  std::vector<CellFace> faces = leftovers.UnsettledFaces();
  for (const CellFace& face : *loops) {
    if (!leftovers.IsSettled(face)) faces.push_back(face);
  }
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  const auto complex =
      FaceComplex::Build(static_cast<int32_t>(cubes.vertices.size()), std::move(faces));
  auto found = SearchAll(complex, cubes.vertices, params.assembly.min_quality, context);
  if (!found.ok()) return found.status();
  const size_t direct_count = table.primitives.size();
  for (const Primitive& primitive : *found) {
    if (leftovers.Fits(primitive.corners, kFewestClosedFaces)) {
      table.primitives.push_back(primitive);
    }
  }
  if (table.primitives.size() > direct_count) IndexFaces(cubes, &table);
  return table;
}

// As the paper does it: everything is found by graph search.
absl::StatusOr<PrimitiveTable> ExtractAll(const MergedCubes& cubes, const MeshingParams& params,
                                          RunContext& context) {
  auto faces = CollectFaces(cubes.vertices, CollectCubeEdges(cubes, {}), context);
  if (!faces.ok()) return faces.status();
  const auto complex =
      FaceComplex::Build(static_cast<int32_t>(cubes.vertices.size()), *std::move(faces));
  auto found = SearchAll(complex, cubes.vertices, params.assembly.min_quality, context);
  if (!found.ok()) return found.status();
  PrimitiveTable table;
  table.primitives = *std::move(found);
  const auto is_initial = [](const Primitive& primitive) {
    return primitive.type == PrimitiveType::kHexahedron && primitive.quality > kInitialQuality;
  };
  const auto pool =
      std::stable_partition(table.primitives.begin(), table.primitives.end(), is_initial);
  table.initial_count = static_cast<int32_t>(pool - table.primitives.begin());
  IndexFaces(cubes, &table);
  return table;
}

}  // namespace

absl::StatusOr<PrimitiveTable> ExtractTopology(const MergedCubes& cubes,
                                               const MeshingParams& params, RunContext& context) {
  if (absl::Status status = CheckShapes(cubes); !status.ok()) return status;
  return params.assembly.extraction == Extraction::kPaper ? ExtractAll(cubes, params, context)
                                                          : ExtractDirect(cubes, params, context);
}

}  // namespace amhex
