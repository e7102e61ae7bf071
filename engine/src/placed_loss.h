// What a placed mesh costs, by which trials are compared.
#pragma once

#include "assembly/cell_complex.h"
#include "base/stop_poll.h"
#include "optimize/improve_mesh.h"

namespace amhex {

// Below this minimum, each tenth counts as much as five hundredths of the average.
inline constexpr double kGoodMinimum = 0.3;
// What refilling is expected to make good: it raises most minima above this to the former.
inline constexpr double kMendableMinimum = 0.2;

// Less is better.
struct PlacedLoss {
  double cells = 0;  // of the average and of another number of cells than wanted
  // Faults:
  double minimum = 0;
  double distance = 0;
  double lost = 0;     // of a part that no cell reaches into, or of one too many
  double handles = 0;  // of handles and parts that the input does not have
  double faults() const { return minimum + distance + lost + handles; }
  double total() const { return cells + faults(); }
};

// A mesh that leaves out the tip of a wedge has better cells than one that reaches into it, so
// distances count as well. Throws RunStopped when `poll` does.
PlacedLoss LossOf(const CellComplex& placed, const Improvement& with, double good_minimum,
                  const StopPoll& poll);

}  // namespace amhex
