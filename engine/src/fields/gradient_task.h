// One solve by conjugate gradients as plain arrays: what crosses the border to the CUDA library
// that is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <variant>
#include <vector>

#include "base/array_view.h"
#include "exec/resident_slot.h"
#include "fields/linear_operators.h"

namespace amhex::fields {

struct SolveLimits {
  int32_t max_iterations = 0;
  double tolerance = 0;
};

// A solve starts at zero. Views are on host arrays that outlive the task.
struct GradientTask {
  LinearOperator matrix;
  ResidentSlot* links = nullptr;  // of the matrix; null: made for this task
  int64_t node_count = 0;
  ArrayView<const float> right_side;  // [unknown_count]
  std::vector<float>* x = nullptr;    // out: [unknown_count]; as it was unless it was done
  SolveLimits limits;
  std::function<bool()> should_stop;  // may be empty
  int32_t iterations = 0;             // out

  int64_t unknown_count() const {
    return std::visit([this](const auto& of) { return node_count * of.kUnknowns; }, matrix);
  }
};

}  // namespace amhex::fields
