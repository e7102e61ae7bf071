// Where the derivative of a cell's map is looked at.
#pragma once

namespace amhex {

// Of the interval [0, 1], the Gauss point that is nearer to 1: (1 + 1/sqrt 3) / 2; and the other.
inline constexpr double kNearGaussPoint = 0.78867513459481288;
inline constexpr double kFarGaussPoint = 1 - kNearGaussPoint;

}  // namespace amhex
