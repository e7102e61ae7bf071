// The header checks of inputs: whatever the bytes, they answer within limits, and never accept
// counts beyond them. The first byte chooses how much of the file is "at hand".
#include <cstdint>
#include <cstdlib>

#include "input_preflight.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace amhex::server;
  if (size == 0) return 0;
  const size_t file_size = size - 1;
  const size_t at_hand = file_size * data[0] / 255;
  const Limits limits;
  for (const size_t known : {at_hand, file_size}) {
    const InputBytes input{data + 1, known, static_cast<int64_t>(file_size)};
    const auto draco = PreflightDraco(input, limits);
    if (draco.ok() &&
        (draco->point_count < 1 || draco->point_count > limits.max_point_count ||
         draco->triangle_count < 0 || draco->triangle_count > limits.max_triangle_count)) {
      std::abort();
    }
    const auto arrays = PreflightHullArrays(input, limits);
    if (arrays.ok() && (arrays->point_count < 1 || arrays->point_count > limits.max_point_count)) {
      std::abort();
    }
  }
  return 0;
}
