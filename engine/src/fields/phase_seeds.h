// Phases by walking: where no hull fixes an axis (around a ring, say), the equations alone leave
// its phase undetermined, and any walk from any node is a start.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fields/background_grid.h"
#include "fields/lattice_form.h"

namespace amhex::fields {

// has_target[3 * node + axis]: the phase is tied to the hull. Axes of neighbouring nodes that turn
// into each other form one component; in those without any target, adds up the form's increments
// along a breadth-first walk from the component's first entry and writes exp(2 pi i phase) to
// x[2 * (3 * node + axis)] and the entry after it. Other components keep their values. O(nodes).
void SeedFreePhases(const GridLevel& level, const ForwardCodes& codes, const LatticeForm& form,
                    const std::vector<uint8_t>& has_target, std::vector<float>* x);

}  // namespace amhex::fields
