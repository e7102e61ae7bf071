// Phases by walking: where no hull fixes an axis (around a ring, say) or only one far away, the
// equations leave its phase undetermined or lost in rounding, and a walk is a better start.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fields/background_grid.h"
#include "fields/lattice_form.h"

namespace amhex::fields {

// x[2 * (3 * node + axis)] and the entry after it: real and imaginary part of a phase. Those
// shorter than kWeakPhase are replaced by unit numbers: the phases of the others, carried on by the
// form's increments along breadth-first walks; what no walk reaches starts one of its own.
// O(nodes).
inline constexpr double kWeakPhase = 0.01;
void SeedWeakPhases(const GridLevel& level, const ForwardCodes& codes, const LatticeForm& form,
                    std::vector<float>* x);

}  // namespace amhex::fields
