// Puts the vertices of a closed complex where they belong: onto the hull and its features, and
// where the cells are best.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "optimize/hull_features.h"

namespace amhex {

class DeviceUse;

enum class PlacementEffort : uint8_t {
  kValid,     // onto the hull, and the worst cells raised: between changes of the cells
  kBest,      // and the average raised: at the end
  kJoint,     // poor cells raised jointly (raise_jointly), and nothing else
  kBearable,  // the worst cells raised until none is below kBearable, and nothing else
  kRaise,     // the average raised, and nothing drawn to the hull: placed already, cells unchanged
};
// Above what is refilled (refill_places.h).
inline constexpr double kBearable = 0.31;

// Hull vertices go to the hull: those whose faces lie on two patches to the crease between them,
// the nearest one to each corner. Then the minimum scaled Jacobian is raised, and the average
// without losing the minimum; hull vertices slide. Cells and hull faces keep their indices.
//
// Requires a closed complex: every face of a cell is shared or listed in hull_faces. No cell that
// was valid by CellQuality becomes invalid, and the minimum quality after the vertices have been
// projected only rises; projecting itself may cost quality down to a floor of 0.25, no more.
//
// `features` must be those of the hull. Same result at any thread count. Linear in the number of
// cells, ~0.1 ms each. Sweeps run on `device`, or on the CPU where it is null, with the same bits.
// Where only some cells have changed since `settled` was returned, vertices away from those are
// drawn nowhere, and are moved only with one beside them, or where a cell is very poor.
// Errors: CANCELLED, DEADLINE_EXCEEDED, INTERNAL (a cell of no known type), and those of RunOnCuda.
absl::StatusOr<CellComplex> PlaceVertices(CellComplex complex, const HullFeatures& features,
                                          RunContext& run,
                                          PlacementEffort effort = PlacementEffort::kBest,
                                          DeviceUse* device = nullptr,
                                          const CellComplex* settled = nullptr);

// The same for a part of a mesh: vertices v with fixed[v] = 1 stay; those behind the end of `fixed`
// may move. Faces towards cells that are not in the part need not be closed, but the vertices of
// the cells there must be fixed. Tells nobody of its progress.
absl::StatusOr<CellComplex> PlacePart(CellComplex part, const std::vector<uint8_t>& fixed,
                                      const HullFeatures& features, const RunContext& run,
                                      PlacementEffort effort);

}  // namespace amhex
