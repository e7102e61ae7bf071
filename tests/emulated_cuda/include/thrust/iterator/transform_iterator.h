// A function of another array's elements, as an array.
#pragma once

#include <cstdint>

// NOLINTBEGIN(readability-identifier-naming): CUDA's names

namespace thrust {

template <class Iterator, class Function>
struct transform_iterator {
  Iterator values;
  Function function;
  auto operator[](int64_t index) const { return function(values[index]); }
};

template <class Iterator, class Function>
transform_iterator<Iterator, Function> make_transform_iterator(Iterator values, Function function) {
  return {values, function};
}

}  // namespace thrust
// NOLINTEND(readability-identifier-naming)
