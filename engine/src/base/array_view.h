// A pointer and a count, trivially copyable so that it can travel to a device inside a body.
#pragma once

#include <cassert>
#include <cstdint>

#include "amhex/vec3.h"

namespace amhex {

// Does not own. Bounds are checked in debug builds, on the host and on the device.
template <class T>
struct ArrayView {
  T* data = nullptr;
  int64_t size = 0;

  AMHEX_HD T& operator[](int64_t index) const {
    assert(index >= 0 && index < size);
    return data[index];
  }
  AMHEX_HD bool empty() const { return size == 0; }
};

// C++20 deduces this by itself, clang 14 does not.
template <class T>
ArrayView(T* data, int64_t size) -> ArrayView<T>;

// The same elements, read-only.
template <class T>
ArrayView<const T> ReadOnly(ArrayView<T> view) {
  return {view.data, view.size};
}

}  // namespace amhex
