// The numbers themselves, as an array.
#pragma once

#include <cstdint>

// NOLINTBEGIN(readability-identifier-naming): CUDA's names

namespace thrust {

template <class T>
struct counting_iterator {
  explicit counting_iterator(T first) : first_(first) {}
  T operator[](int64_t index) const { return first_ + index; }

 private:
  T first_;
};

}  // namespace thrust
// NOLINTEND(readability-identifier-naming)
