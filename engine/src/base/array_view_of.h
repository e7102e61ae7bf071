// Views of whole vectors.
#pragma once

#include <cstdint>
#include <vector>

#include "base/array_view.h"

namespace amhex {

template <class T>
ArrayView<const T> ArrayViewOf(const std::vector<T>& values) {
  return {values.data(), static_cast<int64_t>(values.size())};
}

template <class T>
ArrayView<T> WritableViewOf(std::vector<T>& values) {
  return {values.data(), static_cast<int64_t>(values.size())};
}

}  // namespace amhex
