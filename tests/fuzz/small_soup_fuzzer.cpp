// Small random soups of triangles through the whole engine: a lawful mesh or an error.
#include <cstddef>
#include <cstdint>

#include "fuzz/fuzz_inputs.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  amhex::fuzz::MeshSmallSoup(data, size);
  return 0;
}
