// From a closed lattice form back to frames and sizes.
#pragma once

#include "fields/lattice_form.h"

namespace amhex::fields {

// Reads form->increments, and form->frames and form->sizes as the expectation that replaces a
// degenerate Jacobian; writes steps, frames and sizes, then rescales increments, steps and sizes so
// that the nodes hold `density` cells per edge length cubed on average.
void RecoverFrames(const BackgroundGrid& grid, const ForwardCodes& codes, double density,
                   const RunContext& run, LatticeForm* form);

}  // namespace amhex::fields
