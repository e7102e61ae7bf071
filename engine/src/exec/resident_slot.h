// Where the copy of some arrays on a device waits for the tasks that read them.
#pragma once

#include <memory>

namespace amhex {

// Lies beside the arrays and ends with them; null until the first task makes the copy
// (resident_arrays.h). Like tasks, used from one thread at a time.
using ResidentSlot = std::shared_ptr<void>;

}  // namespace amhex
