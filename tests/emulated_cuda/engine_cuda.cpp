// The engine's CUDA library as it is, compiled for the emulated device.
#include "cuda/engine_cuda.cu"  // NOLINT: the whole library is this file

#include "emulated_cuda/emulated_device.h"

extern "C" __attribute__((visibility("default"))) amhex::emulated::Device* AmhexEmulatedDevice() {
  return &amhex::emulated::TheDevice();
}
