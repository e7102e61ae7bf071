// Loops over many items on all threads that end when the run is to stop.
#pragma once

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/stop_poll.h"

namespace amhex {

// body(block, i) for every i below `count`; `per_block` in a row are a block, one thread's. Throws
// RunStopped when `poll` does, which is asked before every block.
template <class Body>
void ForBlocksPolling(size_t count, size_t per_block, const StopPoll& poll, const Body& body) {
  oneapi::tbb::parallel_for(size_t{0}, (count + per_block - 1) / per_block, [&](size_t block) {
    poll.Now();
    const size_t end = std::min(count, (block + 1) * per_block);
    for (size_t i = block * per_block; i < end; ++i) body(block, i);
  });
}

// body(i) likewise.
template <class Body>
void ForAllPolling(size_t count, size_t per_block, const StopPoll& poll, const Body& body) {
  ForBlocksPolling(count, per_block, poll, [&](size_t, size_t i) { body(i); });
}

// What find(i, found) appends to `found` for every i, in their order.
template <class T, class Find>
std::vector<T> FindAllPolling(size_t count, size_t per_block, const StopPoll& poll,
                              const Find& find) {
  std::vector<std::vector<T>> of_block((count + per_block - 1) / per_block);
  ForBlocksPolling(count, per_block, poll,
                   [&](size_t block, size_t i) { find(i, of_block[block]); });
  size_t total = 0;
  for (const std::vector<T>& found : of_block) total += found.size();
  std::vector<T> all;
  all.reserve(total);
  for (const std::vector<T>& found : of_block) all.insert(all.end(), found.begin(), found.end());
  return all;
}

}  // namespace amhex
