// Most of the last stage but one: vertices to their places, poor cells replaced, vertices again.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"
#include "optimize/hull_features.h"

namespace amhex {

class DeviceUse;

// What meshes of one hull are improved with.
struct Improvement {
  const Hull& hull;
  const HullFeatures& features;
  const MeshingParams& params;
  DeviceUse* device = nullptr;  // where vertices are placed; null: on the CPU
};

struct ImprovedMesh {
  CellComplex complex;
  bool is_defective = false;  // its boundary touches or crosses itself, or may do so
};

// Alternates PlaceVertices (geometry) with PeelStars, JoinStars and RepairCells (topology) until
// nothing is replaced or a bound on the rounds is reached. What is still poor then is for
// RefillPlaces. The complex must be closed and stays so.
// Errors: CANCELLED, DEADLINE_EXCEEDED, and those of RunOnCuda.
absl::StatusOr<ImprovedMesh> ImproveMesh(CellComplex complex, const Improvement& with,
                                         RunContext& run);

}  // namespace amhex
