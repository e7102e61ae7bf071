// What is decided once the partial sums of a solve are there.
#pragma once

#include <cstdint>

#include "exec/executor.h"

namespace amhex::fields {

// One element. A body has
//   int64_t block_count() const;         and, of its sums,
//   double OfBlock(int64_t block) const;
//   void Decide(double total) const;     all of them added up in their order
template <class Body>
struct DecideAloneBody {
  Body body;
  AMHEX_HD void operator()(int64_t /*index*/) const {
    double total = 0;
    for (int64_t block = 0; block < body.block_count(); ++block) total += body.OfBlock(block);
    body.Decide(total);
  }
};

// The CUDA executor has one of its own (ordered_total.cuh).
template <class E>
struct OrderedTotal {
  // Nothing where `is_live` is zero.
  template <class Body>
  static void Decide(E& executor, const char* description, ArrayView<const int64_t> is_live,
                     const Body& body) {
    executor.ForEachOf(description, 1, is_live, DecideAloneBody<Body>{body});
  }
};

}  // namespace amhex::fields
