// Counts what is wrong with an input and remembers the first place.
#pragma once

#include <cstddef>
#include <string>

#include "absl/strings/str_cat.h"

namespace amhex {

class Offenders {
 public:
  void Add(size_t index) {
    if (count_++ == 0) first_ = index;
  }
  bool Any() const { return count_ > 0; }
  // "triangle 17 (first of 3)"
  std::string Describe(const char* what) const {
    return absl::StrCat(what, " ", first_,
                        count_ == 1 ? "" : absl::StrCat(" (first of ", count_, ")"));
  }
  size_t first() const { return first_; }

 private:
  size_t first_ = 0;
  size_t count_ = 0;
};

}  // namespace amhex
