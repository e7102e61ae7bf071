// One solve by conjugate gradients as plain arrays: what crosses the border to the CUDA library
// that is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/array_view.h"
#include "fields/linear_operators.h"

namespace amhex::fields {

struct SolveLimits {
  int32_t max_iterations = 0;
  double tolerance = 0;
};

// All solves of one phase field: a plain one from zero, after which weak phases are seeded
// (phase_seeds.h), then rounds, each from where the last one ended and pulled towards the unit
// numbers in its direction. Right sides and diagonals follow from that.
struct PhaseCourse {
  ArrayView<const float> hull_target;           // [unknown_count]
  SolveLimits first;                            // of the plain solve
  std::vector<float> pulls;                     // by round
  std::function<void(int32_t round)> on_round;  // may be empty; called before each
};

// Views are on host arrays that outlive the task.
struct GradientTask {
  LinearOperator matrix;
  int64_t node_count = 0;
  // Of a PhaseOperator, whose pull its rounds set; `x` is only written then. Or:
  const PhaseCourse* course = nullptr;
  ArrayView<const float> inverse_diagonal;  // [unknown_count] > 0
  ArrayView<const float> right_side;        // [unknown_count]
  std::vector<float>* x = nullptr;    // [unknown_count] in and out; as it was unless it was done
  SolveLimits limits;                 // of each solve, but for the first of a course
  std::function<bool()> should_stop;  // may be empty
  int32_t iterations = 0;             // out: of the last solve

  int64_t unknown_count() const { return static_cast<int64_t>(x->size()); }
};

}  // namespace amhex::fields
