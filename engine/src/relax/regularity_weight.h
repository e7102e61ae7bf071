// w(p) of eq. 4.
#pragma once

namespace amhex {

// How much the neighbours' centre counts at progress p in [0, 1]: zero in the first half, a cosine
// bump that peaks with 1 at p = 3/4 and returns to zero at the end.
double RegularityWeight(double progress);

}  // namespace amhex
