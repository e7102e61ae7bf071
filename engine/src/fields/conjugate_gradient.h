// Conjugate gradients with a diagonal preconditioner for the fields' least-squares systems.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "exec/resident_slot.h"
#include "fields/linear_operators.h"

namespace amhex {
class DeviceUse;
}

namespace amhex::fields {

// Symmetric positive definite. Single precision: the systems are large and bound by memory, and
// their tolerances are 1e-3 to 1e-4; sums are taken in double precision in a fixed order.
struct LinearSystem {
  std::function<void(const std::vector<float>& x, std::vector<float>& product)> apply;
  std::vector<float> diagonal;  // > 0
  // Where it is solved, and the same matrix for there; null: on the CPU.
  DeviceUse* device = nullptr;
  LinearOperator matrix;  // on arrays that outlive the system
  // Where the device keeps those arrays for systems that differ in other ways; may be null.
  ResidentSlot* resident = nullptr;
};

struct ConjugateGradientLimits {
  int max_iterations = 0;
  double tolerance = 0;  // of the preconditioned residual's norm against the right side's
};

// Improves `x` (same size as `rhs`) in place; returns the number of iterations done. Stops early at
// the tolerance. The same bits on the CPU and on a device. RESOURCE_EXHAUSTED when a device that
// was asked for has too little memory, CANCELLED or DEADLINE_EXCEEDED when the run stops.
// O(unknowns) per iteration.
absl::StatusOr<int> SolveConjugateGradient(const LinearSystem& system,
                                           const std::vector<float>& rhs,
                                           const ConjugateGradientLimits& limits,
                                           const RunContext& run, std::vector<float>* x);

}  // namespace amhex::fields
