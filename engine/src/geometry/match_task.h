// The search for face candidates as plain arrays: what crosses the border to the CUDA library that
// is loaded at run time.
#pragma once

#include <functional>
#include <vector>

#include "geometry/face_candidates.h"

namespace amhex {

// Views are on host arrays that outlive the task.
struct MatchTask {
  CandidateSearch search;
  std::vector<FaceCandidate> candidates;  // out: by cube a; as they were unless it was done
  std::function<bool()> should_stop;      // may be empty
};

}  // namespace amhex
