// What no later stage could make sense of in a volume mesh, told in the input's own indices.
#pragma once

#include "absl/status/status.h"
#include "amhex/input_hull.h"

namespace amhex {

// INVALID_ARGUMENT for lists whose lengths contradict each other, cells of fewer than four faces,
// faces of fewer than three corners, and indices out of range (naming the first offender and how
// many there are). OUT_OF_RANGE for more elements than 32-bit indices reach. Coordinates are
// checked along with every other input's. Linear; allocates nothing.
absl::Status CheckVolumeLists(const VolumeMesh& mesh);

}  // namespace amhex
