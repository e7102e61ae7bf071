// What a failed CUDA call becomes on its way to a status.
#pragma once

#include <stdexcept>
#include <string>

namespace amhex {

// Thrown by the CUDA executor; never leaves the CUDA library.
class CudaError : public std::runtime_error {
 public:
  CudaError(const std::string& message, bool is_out_of_memory)
      : std::runtime_error(message), is_out_of_memory_(is_out_of_memory) {}
  bool is_out_of_memory() const { return is_out_of_memory_; }

 private:
  bool is_out_of_memory_;
};

}  // namespace amhex
