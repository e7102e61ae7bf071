// The last of some numbers where bodies run: how many there are of what was counted and scanned.
#pragma once

#include <cstdint>

#include "exec/executor.h"

namespace amhex {

struct LastElementBody {
  ArrayView<const int32_t> values;
  AMHEX_HD int64_t operator()(int64_t /*index*/) const { return values[values.size - 1]; }
};

// Waits for it. There is at least one.
template <class E>
int64_t LastElement(E& executor, const Buffer<E, int32_t>& values) {
  return executor.Reduce("take the last number", 1, LastElementBody{values.View()});
}

}  // namespace amhex
