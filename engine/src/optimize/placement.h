// What the steps of vertex placement share: the complex, its neighbourhoods and the constraints.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "exec/resident_slot.h"
#include "optimize/hull_features.h"
#include "optimize/local_cells.h"
#include "optimize/placement_view.h"
#include "optimize/vertex_constraints.h"
#include "optimize/vertex_neighbourhoods.h"

namespace amhex {

class DeviceUse;
struct SweepTask;

// What a sweep wants to know of every cell before it starts. Both follow from the positions of the
// cell's vertices alone.
struct CellSurvey {
  std::vector<float> min_scaled_jacobian;  // [cell_count]
  std::vector<uint8_t> near_folding;       // [cell_count] 1: the fold margin should be watched
};

struct Placement {
  CellComplex& complex;
  const HullFeatures& features;
  const VertexNeighbourhoods neighbourhoods;
  VertexConstraints constraints;
  CellSurvey survey;                   // as of the last step that has ended
  std::vector<Vec3d> known_feet = {};  // [vertex_count] or none; see PlacementView
  DeviceUse* device = nullptr;         // where to sweep; null = on the CPU
  ResidentSlot resident = {};          // for the device's copy of cells and neighbourhoods
};
// Cells must be of Figure 2; `complex` and `features` must outlive the placement. O(n log n).
// Throws RunStopped when `poll` does, like all below that takes one.
Placement PreparePlacement(CellComplex& complex, const HullFeatures& features,
                           const StopPoll& poll = {});

// The placement's own arrays, as they are now.
PlacementView ViewOf(Placement& placement);

// What vertices try first, edge lengths.
inline constexpr float kFirstSweepStep = 0.1F;

// Which vertices a later sweep need not look at, and how far each moved last.
struct SweepMemory {
  std::vector<uint8_t> active;  // [vertex_count]
  std::vector<float> step;      // [vertex_count] next trial step, edge lengths
};
SweepMemory StartSweeps(int64_t vertex_count);

// What a device is given for any step on the placement, which with the memory must outlive it.
SweepTask TaskFor(Placement& placement, SweepMemory& memory, const RunContext& run);

// Surveys all cells.
void SurveyAllCells(Placement& placement, const StopPoll& poll = {});
// Surveys the cells anew of which a vertex has moved, and activates all their vertices.
void NoteMoves(const std::vector<uint8_t>& moved, Placement& placement, SweepMemory& memory,
               const StopPoll& poll);

// Room for the cells around one vertex, on the stack for most.
using LocalRoom = absl::InlinedVector<LocalCell, 10>;

}  // namespace amhex
