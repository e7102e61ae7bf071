#include "topology/extract_topology.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "topology/collect_faces.h"
#include "topology/direct_cells.h"
#include "topology/face_complex.h"
#include "topology/leftovers.h"
#include "topology/parallel_blocks.h"
#include "topology/search_primitives.h"

namespace amhex {
namespace {

// Hexahedra above this scaled Jacobian start the mesh; section 5.2, III.
constexpr double kInitialQuality = 0.5;
constexpr int64_t kPrimitivesPerBlock = 4096;

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
absl::Status IndexFaces(const MergedCubes& cubes, const RunContext& context,
                        PrimitiveTable* table) {
  AMHEX_RETURN_IF_ERROR(context.CheckStop());
  std::vector<CellFace> faces;
  faces.reserve(6 * table->primitives.size());
  for (const Primitive& primitive : table->primitives) {
    for (const CellFace& face : FacesOf(primitive.corners)) faces.push_back(face);
  }
  table->faces = FaceTable::Build(static_cast<int32_t>(cubes.vertices.size()), faces);
  const auto count = static_cast<int64_t>(table->primitives.size());
  const auto look_up = [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) LookUpHalfFaces(table->faces, &table->primitives[i]);
  };
  AMHEX_RETURN_IF_ERROR(ForEachBlock(count, kPrimitivesPerBlock, context, look_up));
  table->on_hull = MarkHullFaces(cubes, table->faces);
  return context.CheckStop();
}

void AppendFaces(const CellCorners& corners, std::vector<CellFace>* faces) {
  for (const CellFace& face : FacesOf(corners)) faces->push_back(StandingHalfFace(face));
}

void SortUnique(std::vector<CellFace>* faces) {
  tbb::parallel_sort(faces->begin(), faces->end());
  faces->erase(std::unique(faces->begin(), faces->end()), faces->end());
}

bool IsInitial(const Primitive& primitive) {
  return primitive.type == PrimitiveType::kHexahedron && primitive.quality > kInitialQuality;
}

// The faces among which the search around the initial mesh looks: those of it that are not
// settled, those of the other direct cells, and the loops of the edges around them.
absl::StatusOr<FaceComplex> CollectLeftoverFaces(const MergedCubes& cubes,
                                                 const Leftovers& leftovers,
                                                 const std::vector<Primitive>& others,
                                                 const RunContext& context, DeviceUse& device) {
  AMHEX_ASSIGN_OR_RETURN(
      std::vector<CellFace> faces,
      CollectFaces(cubes.vertices, CollectCubeEdges(cubes, leftovers.region()), context, &device));
  for (const Primitive& primitive : others) AppendFaces(primitive.corners, &faces);
  std::erase_if(faces, [&](const CellFace& face) { return leftovers.IsSettled(face); });
  const std::vector<CellFace> unsettled = leftovers.UnsettledFaces();
  faces.insert(faces.end(), unsettled.begin(), unsettled.end());
  SortUnique(&faces);
  return FaceComplex::Build(static_cast<int32_t>(cubes.vertices.size()), std::move(faces));
}

// The default: direct hexahedra of high quality start the mesh, all other direct cells and what
// the search finds around them compete for the rest. (The search finds those direct cells again;
// of equals the first one listed is taken.)
absl::StatusOr<PrimitiveTable> ExtractDirect(const MergedCubes& cubes, const MeshingParams& params,
                                             RunContext& context, DeviceUse& device) {
  AMHEX_ASSIGN_OR_RETURN(std::vector<Primitive> direct, FindDirectCells(cubes, params, context));
  const auto middle = std::stable_partition(direct.begin(), direct.end(), IsInitial);
  PrimitiveTable table;
  table.primitives.assign(direct.begin(), middle);
  table.initial_count = static_cast<int32_t>(table.primitives.size());
  AMHEX_RETURN_IF_ERROR(IndexFaces(cubes, context, &table));
  const std::vector<Primitive> others(middle, direct.end());
  const Leftovers leftovers(cubes, table);
  if (leftovers.IsEmpty()) return table;
  AMHEX_ASSIGN_OR_RETURN(const FaceComplex complex,
                         CollectLeftoverFaces(cubes, leftovers, others, context, device));
  AMHEX_ASSIGN_OR_RETURN(
      std::vector<Primitive> found,
      SearchPrimitives(complex, cubes.vertices, params.assembly.min_quality, context, &device));
  std::erase_if(found, [&](const Primitive& p) { return !leftovers.Fits(p.corners); });
  table.primitives.insert(table.primitives.end(), others.begin(), others.end());
  table.primitives.insert(table.primitives.end(), found.begin(), found.end());
  if (table.primitives.size() > static_cast<size_t>(table.initial_count)) {
    AMHEX_RETURN_IF_ERROR(IndexFaces(cubes, context, &table));
  }
  return table;
}

// As the paper does it: everything is found by graph search.
absl::StatusOr<PrimitiveTable> ExtractAll(const MergedCubes& cubes, const MeshingParams& params,
                                          RunContext& context, DeviceUse& device) {
  AMHEX_ASSIGN_OR_RETURN(
      std::vector<CellFace> faces,
      CollectFaces(cubes.vertices, CollectCubeEdges(cubes, {}), context, &device));
  // A badly shaped face of a cube stays besides its two triangles; the assembly decides.
  for (const CellCorners& corners : cubes.corners) AppendFaces(corners, &faces);
  SortUnique(&faces);
  const auto complex =
      FaceComplex::Build(static_cast<int32_t>(cubes.vertices.size()), std::move(faces));
  AMHEX_ASSIGN_OR_RETURN(
      std::vector<Primitive> found,
      SearchPrimitives(complex, cubes.vertices, params.assembly.min_quality, context, &device));
  PrimitiveTable table;
  table.primitives = std::move(found);
  const auto pool =
      std::stable_partition(table.primitives.begin(), table.primitives.end(), IsInitial);
  table.initial_count = static_cast<int32_t>(pool - table.primitives.begin());
  AMHEX_RETURN_IF_ERROR(IndexFaces(cubes, context, &table));
  return table;
}

}  // namespace

absl::StatusOr<PrimitiveTable> ExtractTopology(const MergedCubes& cubes,
                                               const MeshingParams& params, RunContext& context) {
  AMHEX_RETURN_IF_ERROR(CheckShapes(cubes));
  AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(params.run.backend));
  AMHEX_ASSIGN_OR_RETURN(PrimitiveTable table, params.assembly.extraction == Extraction::kPaper
                                                   ? ExtractAll(cubes, params, context, device)
                                                   : ExtractDirect(cubes, params, context, device));
  table.device_notes = device.notes();
  return table;
}

}  // namespace amhex
