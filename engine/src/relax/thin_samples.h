// As many hull samples as the cells at the hull can tell apart.
#pragma once

#include "input/hull.h"

namespace amhex {

// Keeps, per cube of a third of an edge length, the first sample of every clearly different normal
// (at most three: a corner). Order is kept; deterministic. O(n log n).
HullSamples ThinSamples(const HullSamples& samples);

}  // namespace amhex
