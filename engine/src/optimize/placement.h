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
#include "optimize/visit_by_colour.h"

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
  CellSurvey survey;  // as of the last step that has ended
  // See PlacementView; none are as good.
  std::vector<Vec3d> known_feet = {};          // [vertex_count]
  std::vector<int32_t> likely_triangles = {};  // [hull face]
  DeviceUse* device = nullptr;                 // where to sweep; null = on the CPU
  ResidentSlot resident = {};                  // for the device's copy of cells and neighbourhoods
};
// Cells must be of Figure 2; `complex` and `features` must outlive the placement. O(n log n).
// Throws RunStopped when `poll` does, like all below that takes one.
Placement PreparePlacement(CellComplex& complex, const HullFeatures& features,
                           const StopPoll& poll = {});

// The placement's own arrays, as they are now.
PlacementView ViewOf(Placement& placement);

// What vertices try first, edge lengths.
inline constexpr float kFirstSweepStep = 0.1F;

// Some of the vertices, such as those that the next sweep has to look at.
class ActiveVertices {
 public:
  // All of them, or none.
  static ActiveVertices All(int64_t count);
  static ActiveVertices None(int64_t count);

  void Add(int32_t v) {
    if (is_active_[v] != 0) return;
    is_active_[v] = 1;
    list_.push_back(v);
    is_sorted_ = false;
  }
  void Clear();
  bool Has(int32_t v) const { return is_active_[v] != 0; }
  bool AreAll() const { return list_.size() == is_active_.size(); }
  bool AreNone() const { return list_.empty(); }
  int64_t count() const { return static_cast<int64_t>(is_active_.size()); }
  // Ascending.
  const std::vector<int32_t>& list();

  // [vertex] For a device, which changes them; then they must be listed anew.
  std::vector<uint8_t>& flags() { return is_active_; }
  void ListAnew();

 private:
  std::vector<uint8_t> is_active_;  // [vertex]
  std::vector<int32_t> list_;       // of these
  bool is_sorted_ = true;
};

ActiveVertices AllVertices(const Placement& placement);

// Which vertices a later sweep need not look at, and how far each moved last.
struct SweepMemory {
  ActiveVertices active;
  std::vector<float> step;  // [vertex_count] next trial step, edge lengths
  VisitScratch scratch = {};
};
SweepMemory StartSweeps(int64_t vertex_count);

// What a device is given for any step on the placement, which with the memory must outlive it.
SweepTask TaskFor(Placement& placement, SweepMemory& memory, const RunContext& run);

// Surveys all cells.
void SurveyAllCells(Placement& placement, const StopPoll& poll = {});
// Those that are marked by vertex.
std::vector<int32_t> Marked(const std::vector<int32_t>& vertices,
                            const std::vector<uint8_t>& marks);
// Surveys the cells anew of which one of these vertices has moved, and activates all vertices of
// theirs.
void NoteMoves(const std::vector<int32_t>& moved, Placement& placement, SweepMemory& memory,
               const StopPoll& poll);

// Room for the cells around one vertex, on the stack for most.
using LocalRoom = absl::InlinedVector<LocalCell, 10>;

}  // namespace amhex
