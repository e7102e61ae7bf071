// How often loops whose rounds run on their own are asked whether anything is left to do.
#pragma once

namespace amhex {

// Rounds after the last change nothing and cost a few launches, of some microseconds each. Asking
// costs several launches, too, and the host's way to the device and back in which nothing runs.
inline constexpr int kRoundsPerLook = 8;

}  // namespace amhex
