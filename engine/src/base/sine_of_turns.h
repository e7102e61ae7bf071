// Cosine and sine with the same bits on every machine: the last bits of the mathematics libraries'
// differ from one to the next.
#pragma once

#include <cmath>

#include "amhex/vec3.h"

namespace amhex {

struct CosineAndSine {
  double cosine = 1, sine = 0;
};

// Of an angle of so many full turns, of which there are fewer than 2^50; each within 3e-16 of the
// truth. Not numbers for what is none or has no end.
AMHEX_HD inline CosineAndSine OfTurns(double turns) {
  constexpr double kQuarterTurn = 1.57079632679489661923;
  // All of this is exact but for the product: at most half a quarter is left.
  const double quarters = 4 * turns;
  const double whole = std::floor(quarters + 0.5);
  const double angle = (quarters - whole) * kQuarterTurn;
  // The series end where terms fall below 1e-16.
  const double square = angle * angle;
  const double sine_series =
      square *
      (-1.0 / 6 +
       square * (1.0 / 120 +
                 square * (-1.0 / 5040 +
                           square * (1.0 / 362880 +
                                     square * (-1.0 / 39916800 +
                                               square * (1.0 / 6227020800 +
                                                         square * (-1.0 / 1307674368000)))))));
  const double cosine_series =
      square *
      (-1.0 / 2 +
       square * (1.0 / 24 +
                 square * (-1.0 / 720 +
                           square * (1.0 / 40320 +
                                     square * (-1.0 / 3628800 +
                                               square * (1.0 / 479001600 +
                                                         square * (-1.0 / 87178291200 +
                                                                   square / 20922789888000)))))));
  const double sine = angle + angle * sine_series, cosine = 1 + cosine_series;
  const double quarter = whole - 4 * std::floor(whole / 4);
  if (quarter == 1) return {-sine, cosine};
  if (quarter == 2) return {-cosine, -sine};
  if (quarter == 3) return {sine, -cosine};
  return {cosine, sine};
}

}  // namespace amhex
