// Early return on a bad absl::Status or absl::StatusOr.
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#define AMHEX_RETURN_IF_ERROR(expression)          \
  do {                                             \
    absl::Status amhex_status_ = (expression);     \
    if (!amhex_status_.ok()) return amhex_status_; \
  } while (false)

#define AMHEX_CONCAT_INNER(a, b) a##b
#define AMHEX_CONCAT(a, b) AMHEX_CONCAT_INNER(a, b)
#define AMHEX_ASSIGN_OR_RETURN(left, expression) \
  AMHEX_ASSIGN_OR_RETURN_INNER(AMHEX_CONCAT(amhex_status_or_, __LINE__), left, expression)
#define AMHEX_ASSIGN_OR_RETURN_INNER(holder, left, expression) \
  auto holder = (expression);                                  \
  if (!holder.ok()) return holder.status();                    \
  left = std::move(*holder)
