// Conjugate gradients with a diagonal preconditioner for the fields' least-squares systems.
#pragma once

#include <cstdint>
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
  int unknowns = 1;  // per node
  int passes = 1;    // that make a product
  // One pass of product = matrix times x, for the nodes from `begin` to `end`, after the passes
  // before it have been through all nodes. Called by many threads.
  std::function<void(int pass, int64_t begin, int64_t end, const float* x, float* product)> apply;
  // One over the matrix' diagonal, > 0; asked for where the CPU solves.
  std::function<std::vector<float>()> inverse_diagonal;
  // Nodes that follow from those before them (linear_operators.h), the last ones; `apply` is not
  // asked for those.
  int64_t completed_count = 0;
  // Sets those from `begin` to `end`, counted from the first of them, in x, for this right side or,
  // where it is null, for zeros. Called by many threads.
  std::function<void(int64_t begin, int64_t end, const float* right_side, float* x)> complete;
  // Where it is solved, and the same matrix for there; null: on the CPU.
  DeviceUse* device = nullptr;
  LinearOperator matrix;          // on arrays that outlive the system
  ResidentSlot* links = nullptr;  // of the matrix, as GradientTask's
};

struct ConjugateGradientLimits {
  int max_iterations = 0;
  double tolerance = 0;  // of the preconditioned residual's norm against the right side's
};

// Improves `x` in place, from zeros if it is empty or there is a device; otherwise it is as long as
// `rhs`. Returns the number of iterations done. Stops early at the tolerance. The same bits on the
// CPU and on a device. RESOURCE_EXHAUSTED when a device that was asked for has too little memory,
// CANCELLED or DEADLINE_EXCEEDED when the run stops. O(unknowns) per iteration.
absl::StatusOr<int> SolveConjugateGradient(const LinearSystem& system,
                                           const std::vector<float>& rhs,
                                           const ConjugateGradientLimits& limits,
                                           const RunContext& run, std::vector<float>* x);

}  // namespace amhex::fields
