// Phases by walking: where no hull fixes an axis (around a ring, say) or only one far away, the
// equations leave its phase undetermined or lost in rounding, and a walk is a better start.
#pragma once

#include <cstdint>
#include <vector>

#include "base/stop_poll.h"
#include "fields/phase_walk.h"

namespace amhex::fields {

// x[2 * (3 * node + axis)] and the entry after it: real and imaginary part of a phase. Those
// shorter than kWeakPhase are replaced by unit numbers: the phases of the others, carried on along
// breadth-first walks by the matrix' turns; what no walk reaches starts one of its own at its
// smallest number. O(nodes). The same bits as SeedPhases (phase_seeds_impl.h), on host arrays.
void SeedWeakPhases(const PhaseOperator& matrix, const StopPoll& poll, std::vector<float>* x);

}  // namespace amhex::fields
