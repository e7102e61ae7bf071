#include "topology/collect_faces.h"

#include <utility>

#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "topology/collect_faces_task.h"
#include "topology/loop_search.h"
#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

constexpr int64_t kVerticesPerBlock = 256;
// On a device fewer edges cost more than they save (a guess, as in input/ask_hull.h: some fifteen
// copies and launches against a few microseconds per edge).
constexpr size_t kFewestForDevice = 2048;

absl::StatusOr<std::vector<CellFace>> CollectOnCpu(const std::vector<Vec3d>& vertices,
                                                   const std::vector<VertexPair>& edges,
                                                   const RunContext& context) {
  const auto count = static_cast<int32_t>(vertices.size());
  const ArrayView<const Vec3d> positions{vertices.data(), count};
  EdgeNetwork network = EdgeNetwork::Build(count, edges);
  std::vector<VertexPair> added;
  AMHEX_RETURN_IF_ERROR(CollectItems(count, kVerticesPerBlock, context,
                                     DiagonalSearch{{network.view()}, positions}, &added));
  AMHEX_RETURN_IF_ERROR(CollectItems(count, kVerticesPerBlock, context,
                                     SpiralEdgeSearch{{network.view()}, positions}, &added));
  if (!added.empty()) {
    added.insert(added.end(), edges.begin(), edges.end());
    network = EdgeNetwork::Build(count, added);
  }
  std::vector<CellFace> faces;
  AMHEX_RETURN_IF_ERROR(
      CollectItems(count, kVerticesPerBlock, context, TriangleSearch{network.view()}, &faces));
  AMHEX_RETURN_IF_ERROR(CollectItems(count, kVerticesPerBlock, context,
                                     WellShapedQuadSearch{{network.view()}, positions}, &faces));
  return faces;
}

}  // namespace

absl::StatusOr<std::vector<CellFace>> CollectFaces(const std::vector<Vec3d>& vertices,
                                                   const std::vector<VertexPair>& edges,
                                                   const RunContext& context, DeviceUse* device) {
  CollectFacesTask task{{{edges.data(), static_cast<int64_t>(edges.size())},
                         {vertices.data(), static_cast<int64_t>(vertices.size())}},
                        {},
                        [&context] { return context.ShouldStop(); }};
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    AMHEX_ASSIGN_OR_RETURN(task.faces, CollectOnCpu(vertices, edges, context));
    return true;
  };
  DeviceUse* const where = edges.size() < kFewestForDevice ? nullptr : device;
  AMHEX_RETURN_IF_ERROR(RunWhereChosen(where, &task, on_cpu).status());
  AMHEX_RETURN_IF_ERROR(context.CheckStop());
  return std::move(task.faces);
}

}  // namespace amhex
