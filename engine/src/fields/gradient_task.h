// One solve by conjugate gradients as plain arrays: what crosses the border to the CUDA library
// that is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/array_view.h"
#include "exec/resident_slot.h"
#include "fields/linear_operators.h"

namespace amhex::fields {

// Solves of one phase field in a row, each from where the last one ended and pulled towards the
// unit numbers in its direction. Right side and diagonal follow from that.
struct PullRounds {
  ArrayView<const float> hull_target;           // [unknown_count]
  std::vector<float> pulls;                     // by round
  std::function<void(int32_t round)> on_round;  // may be empty; called before each
};

// Views are on host arrays that outlive the task.
struct GradientTask {
  LinearOperator matrix;
  ResidentSlot* resident = nullptr;  // of its arrays, for the tasks that share them; may be null
  int64_t node_count = 0;
  const PullRounds* rounds = nullptr;       // of a PhaseOperator, whose pull they set; or:
  ArrayView<const float> inverse_diagonal;  // [unknown_count] > 0
  ArrayView<const float> right_side;        // [unknown_count]
  std::vector<float>* x = nullptr;  // [unknown_count] in and out; as it was unless it was done
  int32_t max_iterations = 0;       // of each solve
  double tolerance = 0;
  std::function<bool()> should_stop;  // may be empty
  int32_t iterations = 0;             // out: of the last solve

  int64_t unknown_count() const { return static_cast<int64_t>(x->size()); }
};

}  // namespace amhex::fields
