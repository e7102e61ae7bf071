// From an edge network to all faces a primitive may have. Section 5.2, I.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "topology/edge_network.h"
#include "topology/half_face.h"

namespace amhex {

class DeviceUse;

// Adds the shortest diagonals of badly shaped quads and the interior edges of penta-loops to
// `edges`, then returns every triangle and every well-shaped quad of the enlarged network, each
// once, triangles first. On `device`, unless it is null, with the same faces in the same order.
// Fails only with the run's status and with RunOnCuda's.
absl::StatusOr<std::vector<CellFace>> CollectFaces(const std::vector<Vec3d>& vertices,
                                                   const std::vector<VertexPair>& edges,
                                                   const RunContext& context,
                                                   DeviceUse* device = nullptr);

}  // namespace amhex
