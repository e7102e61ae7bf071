// Which backend a run gets, and why.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "amhex/params.h"

namespace amhex {

struct BackendChoice {
  Backend backend = Backend::kCpu;  // kCpu or kCuda
  std::string note;                 // e.g. "cpu (2 threads): no CUDA device: ..."
};

// What `requested` means on this machine. kAuto takes CUDA where it is usable and says what it
// chose and why. FAILED_PRECONDITION with the reason if CUDA is requested and not usable: never
// a silent substitution.
absl::StatusOr<BackendChoice> ChooseBackend(Backend requested);

}  // namespace amhex
