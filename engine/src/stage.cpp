#include "stage.h"

#include <sys/resource.h>

namespace amhex {

int64_t PeakMemoryBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  constexpr int64_t kBytesPerKibibyte = 1024;  // Linux reports kibibytes
  return usage.ru_maxrss * kBytesPerKibibyte;
}

}  // namespace amhex
