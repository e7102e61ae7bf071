// Steps of vertex placement as plain arrays: what crosses the border to the CUDA library that is
// loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "base/array_view.h"
#include "exec/resident_slot.h"
#include "optimize/placement_view.h"
#include "optimize/vertex_search.h"

namespace amhex {

// Copies that earlier tasks may have made and later ones will use; none is null.
struct PlacementSlots {
  ResidentSlot* hull = nullptr;
  ResidentSlot* features = nullptr;  // but for the hull
  ResidentSlot* cells = nullptr;     // and their neighbourhoods
};

// Views are on host arrays that outlive the task. Vertices, survey and memory are worked on in
// place, and are as they were unless the task was done.
struct SweepTask {
  PlacementView placement;
  PlacementSlots resident;
  // Set: hull vertices are drawn to the hull before any sweep (project_to_hull.h).
  std::optional<double> projection_floor;
  SweepRules rules;
  int32_t most_sweeps = 0;
  // A sweep that moves fewer is the last: the host goes on.
  int64_t fewest_moved = 0;
  std::vector<uint8_t>* active = nullptr;         // SweepMemory's
  std::vector<float>* step = nullptr;             // SweepMemory's
  std::vector<ArrayView<const int32_t>> colours;  // vertices; no two of one colour share a cell
  std::function<bool()> should_stop;              // may be empty
  int64_t projected_count = 0;                    // out: vertices that were drawn to the hull
  int32_t sweeps_done = 0;                        // out
  int64_t moved_last = 0;                         // out: vertices that the last sweep moved
};

// True if a sweep that moved so many of the vertices is the last.
AMHEX_HD inline bool HasSettled(int64_t moved, int64_t of_vertices, QualityAim aim) {
  // Sweeps end when less than this share of the vertices still moves, but raising the minimum is
  // the work of few vertices.
  constexpr double kIdleShare = 0.002;
  const bool is_idle = static_cast<double>(moved) <= kIdleShare * static_cast<double>(of_vertices);
  return moved == 0 || (is_idle && aim == QualityAim::kAverage);
}

}  // namespace amhex
