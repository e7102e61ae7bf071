// Lets the edges of a surface run along its sharp features.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/input_hull.h"

namespace amhex {

// First flips the long edge of every triangle that is nearly a line, away into its neighbour; then
// the edges whose two opposite vertices lie on a feature while they themselves do not both, so
// that neighbouring feature vertices become joined (Kobbelt et al. 2001, feature sensitive
// extraction). A flip is left undone where the wanted edge exists already or where it would turn a
// triangle over. `rank` has one entry per
// vertex, 2 or more on features. Returns the number of flips.
int64_t FlipToFeatures(const std::vector<uint8_t>& rank, TriangleMesh& mesh);

}  // namespace amhex
