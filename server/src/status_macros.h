// Early return on errors. Debian's absl has no such macros.
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#define AMHEX_RETURN_IF_ERROR(expression)                       \
  do {                                                          \
    ::absl::Status amhex_return_if_error_status = (expression); \
    if (!amhex_return_if_error_status.ok()) {                   \
      return amhex_return_if_error_status;                      \
    }                                                           \
  } while (false)

#define AMHEX_STATUS_CONCAT_INNER(a, b) a##b
#define AMHEX_STATUS_CONCAT(a, b) AMHEX_STATUS_CONCAT_INNER(a, b)

// `declaration` must hold no comma outside parentheses.
#define AMHEX_ASSIGN_OR_RETURN(declaration, expression)                         \
  auto AMHEX_STATUS_CONCAT(amhex_status_or_, __LINE__) = (expression);          \
  if (!AMHEX_STATUS_CONCAT(amhex_status_or_, __LINE__).ok()) {                  \
    return std::move(AMHEX_STATUS_CONCAT(amhex_status_or_, __LINE__)).status(); \
  }                                                                             \
  declaration = std::move(AMHEX_STATUS_CONCAT(amhex_status_or_, __LINE__)).value()
