// eq. 2 on an executor: waves from the samples until every reachable node has its distance.
#pragma once

#include <cstdint>
#include <utility>

#include "exec/executor.h"
#include "graph/hop_distance_body.h"

namespace amhex {

// Returns [node_count] distances; kUnreached where no path leads to a sample (there may be none).
// O(n times the largest distance).
template <class E>
Buffer<E, int32_t> ComputeHopDistance(E& executor, ArrayView<const int32_t> neighbours,
                                      int64_t volume_site_count, int64_t node_count) {
  auto before = executor.template Alloc<int32_t>(node_count);
  auto after = executor.template Alloc<int32_t>(node_count);
  executor.ForEach("start hop distances", node_count,
                   HopStartBody{volume_site_count, before.View()});
  executor.ForEach("start hop distances", node_count,
                   HopStartBody{volume_site_count, after.View()});
  for (int64_t wave = 0; wave < volume_site_count && !executor.Stopped(); ++wave) {
    executor.ForEach("advance hop distances", volume_site_count,
                     HopDistanceBody{neighbours, ReadOnly(before.View()), after.View()});
    const int64_t changed =
        executor.Reduce("count changed hop distances", volume_site_count,
                        HopChangedBody{ReadOnly(before.View()), ReadOnly(after.View())});
    std::swap(before, after);
    if (changed == 0) break;
  }
  return before;
}

}  // namespace amhex
