// Makes a placed trial final: its poor places refilled, its boundary at the hull.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "optimize/improve_mesh.h"

namespace amhex {

struct RefilledTrial {
  CellComplex complex;
  bool is_valid = false;  // obeys every law of ValidateMesh
  // Many places of its boundary stay too far from the hull.
  bool is_far_in_many_places = false;
};

// Refills the poor places of `placed`, raises its average and draws its boundary to the hull, where
// `is_followed` does not say that both have been done before; with more vertices where it stays too
// far away, and without edges of no length.
// Errors: CANCELLED, DEADLINE_EXCEEDED, INTERNAL, and those of RunOnCuda.
absl::StatusOr<RefilledTrial> RefillTrial(const CellComplex& placed, bool is_followed,
                                          const Improvement& with, RunContext& run);

// A filling that breaks the law once its vertices are placed is not the only one: further ones of
// the same `assembled` trial, until one is valid or there is none left; then the last of them.
// Errors: as above.
absl::StatusOr<RefilledTrial> FillAnew(const CellComplex& assembled, const Improvement& with,
                                       RunContext& run);

}  // namespace amhex
