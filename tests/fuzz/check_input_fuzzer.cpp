// The checks of every kind of input, and the breaking down of volume meshes: an error or none,
// never harm.
#include <cstddef>
#include <cstdint>

#include "fuzz/fuzz_inputs.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  amhex::fuzz::CheckAnyInput(data, size);
  return 0;
}
