// Which sweeps a device takes: those of so many vertices that it is the sooner of the two.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/used_threads.h"
#include "optimize/vertex_neighbourhoods.h"

namespace amhex {

// The colours of a sweep follow each other, and on an H100 each takes some 0.3 ms however few its
// vertices are: in that time a thread of the host visits so many (docs/performance.md). Results are
// the same to the bit; tests lower it to have all sweeps on the device.
inline std::atomic<int64_t> visits_worth_device{40};

// The fewest vertices to be visited that a device is asked to visit.
inline int64_t FewestVisitsOnDevice(const VertexNeighbourhoods& neighbourhoods) {
  return visits_worth_device.load(std::memory_order_relaxed) *
         static_cast<int64_t>(neighbourhoods.colours.size()) * UsedThreads();
}

// After a sweep about so many times as many vertices as it moved are worth a visit (medians: 1.8
// for bunny at 3,200 cells, 1.5 at 49,000, 1.4 for fandisk).
inline constexpr int64_t kVisitsPerMove = 2;

}  // namespace amhex
