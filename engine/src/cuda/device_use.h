// Which steps of a run go to the device: all that can, if the run's backend says so.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "amhex/params.h"
#include "backends.h"
#include "base/status_macros.h"
#include "cuda/cuda_library.h"

namespace amhex {

// Handed to the steps that can run on either; one per stage, used from one thread.
class DeviceUse {
 public:
  // `requested` may be any of the backends. FAILED_PRECONDITION as ChooseBackend.
  static absl::StatusOr<DeviceUse> Choose(Backend requested) {
    AMHEX_ASSIGN_OR_RETURN(const BackendChoice choice, ChooseBackend(requested));
    return DeviceUse(choice.backend == Backend::kCuda, requested == Backend::kAuto);
  }

  // Runs `task` on the device, or `on_cpu`, which answers like RunOnCuda. Where the run may use
  // either and the device has too little memory the CPU takes the task, and a note tells of the
  // first.
  template <class OnCpu>
  absl::StatusOr<bool> Run(const CudaTask& task, const OnCpu& on_cpu) {
    if (!uses_device_) return on_cpu();
    absl::StatusOr<bool> outcome = RunOnCuda(task);
    if (!may_fall_back_ || !absl::IsResourceExhausted(outcome.status())) return outcome;
    if (notes_.empty()) {
      notes_.push_back(absl::StrCat("on the cpu instead: ", outcome.status().message()));
    }
    return on_cpu();
  }

  bool uses_device() const { return uses_device_; }

  // About the first task that the device had no room for.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  DeviceUse(bool uses_device, bool may_fall_back)
      : uses_device_(uses_device), may_fall_back_(may_fall_back) {}

  bool uses_device_ = false;
  bool may_fall_back_ = false;
  std::vector<std::string> notes_;
};

// The same for steps that may be called without a choice: null means the CPU.
template <class OnCpu>
absl::StatusOr<bool> RunWhereChosen(DeviceUse* device, const CudaTask& task, const OnCpu& on_cpu) {
  return device == nullptr ? absl::StatusOr<bool>(on_cpu()) : device->Run(task, on_cpu);
}

}  // namespace amhex
