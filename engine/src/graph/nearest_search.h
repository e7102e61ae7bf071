// Runs the search for neighbours (knn_exact_body.h) on an executor.
#pragma once

#include <cstdint>

#include "exec/executor.h"
#include "graph/knn_exact_body.h"

namespace amhex {

// The CUDA executor has one of its own (nearest_search.cuh).
template <class E>
struct NearestSearch {
  // Of the first nodes: of as many as `actual_count`, at most `count`, says in its turn.
  static void Run(E& executor, int64_t count, ArrayView<const int64_t> actual_count,
                  const KnnExactBody& body) {
    executor.ForEachOf("find nearest neighbours", count, actual_count, body);
  }
};

}  // namespace amhex
