// The sampling of sample_hull.h as plain arrays: what crosses the border to the CUDA library that
// is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "exec/resident_slot.h"
#include "input/sample_view.h"

namespace amhex {

// Views are on host arrays that outlive the task.
struct SampleTask {
  SampledSurface surface;            // without places, and the hull only if `resident` is empty
  ResidentSlot* resident = nullptr;  // the hull's, never null
  int64_t candidate_count = 0;
  fields::RowShape rows;              // of the candidates
  fields::RowShape sharp_rows;        // of the points along sharp edges
  std::vector<HullSample> samples;    // out: by candidate; as they were unless it was done
  std::function<bool()> should_stop;  // may be empty; asked from several threads
};

}  // namespace amhex
