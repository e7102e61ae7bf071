// What a failed CUDA call becomes on its way to a status.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace amhex {

enum class CudaFault : uint8_t {
  kFailed,       // this run is over; the device is as good as before
  kOutOfMemory,  // the same
  kDeviceLost,   // nothing in this process can use the device any more
};

// Thrown by the CUDA executor; never leaves the CUDA library.
class CudaError : public std::runtime_error {
 public:
  CudaError(const std::string& message, CudaFault fault)
      : std::runtime_error(message), fault_(fault) {}
  CudaFault fault() const { return fault_; }

 private:
  CudaFault fault_;
};

}  // namespace amhex
