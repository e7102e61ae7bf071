// Early returns for absl::Status and absl::StatusOr, which Debian's absl does not bring.
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#define AMHEX_STATUS_CONCAT_INNER(a, b) a##b
#define AMHEX_STATUS_CONCAT(a, b) AMHEX_STATUS_CONCAT_INNER(a, b)

// Returns the status of `expression` from the enclosing function unless it is OK.
#define AMHEX_RETURN_IF_ERROR(expression)                   \
  do {                                                      \
    absl::Status amhex_status_of_expression = (expression); \
    if (!amhex_status_of_expression.ok()) {                 \
      return amhex_status_of_expression;                    \
    }                                                       \
  } while (false)

// Declares or assigns `target` from a StatusOr, or returns its status.
#define AMHEX_ASSIGN_OR_RETURN(target, expression) \
  AMHEX_ASSIGN_OR_RETURN_INNER(AMHEX_STATUS_CONCAT(amhex_statusor_, __LINE__), target, expression)

#define AMHEX_ASSIGN_OR_RETURN_INNER(holder, target, expression) \
  auto holder = (expression);                                    \
  if (!holder.ok()) {                                            \
    return holder.status();                                      \
  }                                                              \
  target = std::move(holder).value()
