// The smoothing behind the orientation field as plain arrays: what crosses the border to the
// executors, and to the CUDA library that is loaded at run time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "base/array_view.h"
#include "exec/resident_slot.h"
#include "fields/balanced_frame.h"
#include "fields/frame_math.h"
#include "fields/grid_keys.h"
#include "fields/grid_neighbours.h"
#include "fields/match_code.h"
#include "fields/quartic_form.h"

namespace amhex::fields {

inline constexpr int kColourCount = 8;
// Ascent towards the neighbours' mean per visit; sweeps do the rest.
inline constexpr int kAscentRounds = 2;

// One level of the background grid. The owner of the arrays outlives the task.
struct SmoothingLevel {
  ArrayView<const int32_t> neighbours;      // [node_count][18] nodes, -1 = none
  ArrayView<const float> weights;           // [node_count][18], or empty: those of the finest level
  ArrayView<const int32_t> parent;          // [node_count] nodes of the level before; empty there
  ArrayView<const int32_t> hull_of_node;    // [node_count] index into hull_forms, -1 = none
  ArrayView<const QuarticForm> hull_forms;  // what hull and guides wish
  std::array<ArrayView<const int32_t>, kColourCount> colours;  // no two neighbours in one of them
  int32_t sweeps = 0;

  int64_t node_count() const { return hull_of_node.size; }
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(neighbours), visit(weights), visit(parent), visit(hull_of_node), visit(hull_forms);
    for (ArrayView<const int32_t>& colour : colours) visit(colour);
  }
  AMHEX_HD float WeightOf(int64_t node, int k) const {
    if (!weights.empty()) return weights[node * kNeighbourCount + k];
    return IsAxisNeighbour(k) ? kAxisWeight : kDiagonalWeight;
  }
  // The parent's frame, out of balance about what the hull wishes; `coarser` are those of the level
  // before.
  AMHEX_HD Quaternion StartOf(int64_t node, ArrayView<const Quaternion> coarser) const {
    const Quaternion inherited = parent.empty() ? Quaternion{} : coarser[parent[node]];
    const int32_t hull = hull_of_node[node];
    return hull < 0 ? inherited : OutOfBalance(hull_forms[hull], inherited);
  }
  // Even sweeps take the colours upwards, odd ones downwards.
  static int ColourOf(int32_t sweep, int step) {
    return (sweep & 1) != 0 ? kColourCount - 1 - step : step;
  }
};

struct SmoothingTask {
  std::vector<SmoothingLevel> levels;  // coarsest first
  CellCentres cells;                   // of the last level: a device finds its neighbours
  std::vector<Quaternion> frames;      // out: [node_count] of the last level
  ForwardCodes codes;                  // out: likewise
  // Of the frames on a device, as an ArrayView<const Quaternion>; null: none stays.
  ResidentSlot* frames_there = nullptr;
  // Both may be empty. The first is asked from several threads. The second is called after each
  // level with its number.
  std::function<bool()> should_stop;
  std::function<void(int32_t)> on_level;
};

// In eight lanes at a time; the device does the same node by node (frame_smoothing_impl.h).
// Every frame starts as its parent's, and moves colour by colour towards what its neighbours and
// the hull wish. False if it was stopped; the task is then as it was.
bool SmoothFramesOnCpu(SmoothingTask& task);

}  // namespace amhex::fields
