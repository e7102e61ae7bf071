// How a long step without a status of its own passes on what it could not do: it throws,
// GuardStage (stage.h) catches.
#pragma once

#include <exception>
#include <string>
#include <utility>

#include "absl/status/status.h"

namespace amhex {

class StatusError : public std::exception {
 public:
  // `status` is not OK.
  explicit StatusError(absl::Status status)
      : status_(std::move(status)), text_(status_.message()) {}
  const absl::Status& status() const { return status_; }
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  absl::Status status_;
  std::string text_;
};

}  // namespace amhex
