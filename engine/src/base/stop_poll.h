// For long steps without a status of their own: they throw, GuardStage (stage.h) catches.
#pragma once

#include <cstdint>
#include <exception>

#include "absl/status/status.h"
#include "amhex/run_context.h"

namespace amhex {

// The run was to stop. Says nothing more: the run's status does.
class RunStopped : public std::exception {
 public:
  const char* what() const noexcept override { return "the run is to stop"; }
};

// Asks a run whether to stop; copies may be used from any number of threads. Without a run it never
// throws.
class StopPoll {
 public:
  StopPoll() = default;
  explicit StopPoll(const RunContext& run) : run_(&run) {}

  // Throws RunStopped if the run is to stop.
  void Now() const {
    if (IsToStop()) throw RunStopped();
  }
  // The same once in kPollInterval consecutive indices: for loops over items of up to some
  // microseconds each.
  void At(int64_t index) const {
    if (index % kPollInterval == 0) Now();
  }
  // For those who do not throw: whether the run is to stop, and the status that says why.
  bool IsToStop() const { return run_ != nullptr && run_->ShouldStop(); }
  absl::Status Status() const { return run_ == nullptr ? absl::OkStatus() : run_->CheckStop(); }

 private:
  static constexpr int64_t kPollInterval = 4096;
  const RunContext* run_ = nullptr;
};

}  // namespace amhex
