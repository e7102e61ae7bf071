// Loops in one copy per vector width of the machine; what those may work on: vector_lanes.h.
#pragma once

#include "base/platform.h"

namespace amhex {

template <class Body>
AMHEX_HD AMHEX_VECTORS_512 void RunWithVectors512(const Body& body) {
  body();
}
template <class Body>
AMHEX_HD AMHEX_VECTORS_256 void RunWithVectors256(const Body& body) {
  body();
}

// Calls `body`, a lambda whose loops are worth the widest vectors. Everything that it calls is
// compiled into the copies. On a device it just runs.
template <class Body>
AMHEX_HD inline void RunWithWidestVectors(const Body& body) {
  switch (WidestVectors()) {
    case VectorWidth::k512:
      return RunWithVectors512(body);
    case VectorWidth::k256:
      return RunWithVectors256(body);
    case VectorWidth::kBaseline:
      return body();
  }
}

}  // namespace amhex
