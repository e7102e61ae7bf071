// The angle of a vector in the plane, with the same bits on every machine: the last bits of the
// mathematics libraries' differ from one to the next.
#pragma once

#include "amhex/vec3.h"

namespace amhex {

// In [-pi, pi], within 5e-16 times itself of the truth; 0 for the null vector, not
// a number for what is none or has no end.
AMHEX_HD inline double ArcTangent2(double y, double x) {
  constexpr double kPi = 3.14159265358979323846;
  // The angles whose tangents are eighths: between them a short series will do.
  constexpr int kEighths = 8;
  constexpr double kAngles[kEighths + 1] = {
      0.0,
      0.12435499454676144,
      0.24497866312686414,
      0.35877067027057225,
      0.4636476090008061,
      0.5585993153435624,
      0.6435011087932844,
      0.7188299996216245,
      0.7853981633974483,
  };
  const double width = x < 0 ? -x : x, height = y < 0 ? -y : y;
  const bool is_steep = height > width;
  const double shorter = is_steep ? width : height, longer = is_steep ? height : width;
  const double tangent = shorter / longer;
  // What is not a number must not become an index.
  if (!(tangent <= 1)) return longer == 0 ? 0 : tangent;
  const int nearest = static_cast<int>(kEighths * tangent + 0.5);
  const double known = static_cast<double>(nearest) / kEighths;
  // tan(a - b) = (tan a - tan b) / (1 + tan a tan b), at most a sixteenth; its arc tangent's series
  // ends where terms fall below 1e-17.
  const double t = (tangent - known) / (1 + tangent * known);
  const double square = t * t;
  const double series =
      square *
      (-1.0 / 3 +
       square *
           (1.0 / 5 +
            square * (-1.0 / 7 + square * (1.0 / 9 + square * (-1.0 / 11 + square * (1.0 / 13))))));
  double angle = kAngles[nearest] + (t + t * series);
  if (is_steep) angle = kPi / 2 - angle;
  if (x < 0) angle = kPi - angle;
  return y < 0 ? -angle : angle;
}

}  // namespace amhex
