// The engine's CUDA library as it is, compiled for the emulated device.
#include "emulated_cuda/emulated_device.h"
#include "relax/relaxation_cuda.cu"  // NOLINT: the whole library is this file

extern "C" __attribute__((visibility("default"))) amhex::emulated::Device* AmhexEmulatedDevice() {
  return &amhex::emulated::TheDevice();
}
