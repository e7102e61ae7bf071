// The frames nearest to several quartic forms at once, in lanes.
#pragma once

#include <array>

#include "base/vector_lanes.h"
#include "fields/quartic_form.h"

namespace amhex::fields {

struct FrameBatch {
  std::array<QuarticForm, kLanes> forms;
  std::array<Quaternion, kLanes> frames;  // start, then result
};

// NearestFrame for every lane, to the bit.
void FindNearestFrames(int rounds, FrameBatch* batch);

}  // namespace amhex::fields
