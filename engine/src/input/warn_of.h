// Warnings that count what was done to an input.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace amhex {

// "`what`: `count`", where there was any.
inline void WarnOf(int64_t count, const char* what, std::vector<std::string>& warnings) {
  if (count > 0) warnings.push_back(absl::StrCat(what, ": ", count));
}

}  // namespace amhex
