// The smooth penalties that moves of vertices lower, with their slopes; usable where bodies run.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "base/platform.h"

namespace amhex {

enum class EnergyKind : uint8_t {
  kCorners,  // the sum of every corner's penalty
  kMinima,   // per cell a norm of its corners' deficits 1 - s: a smooth upper bound of the
             // deficit of its minimum, so that the sum follows the average of the minima
};

// Penalty of a scaled Jacobian s: (1 - s)^2 draws every corner towards 1;
// exp(steepness * (knee - s)) makes those below the knee dominate.
struct CornerPenalty {
  double knee = 0.25;
  double steepness = 15;
  EnergyKind kind = EnergyKind::kCorners;  // kMinima looks at neither number
  // kMinima: the norm is of order 2^sharpness. The higher, the closer the bound (of eight equal
  // deficits by 30 % at order 8, by 7 % at 32), and the shorter the steps.
  int sharpness = 3;
};

// exp(x) for |x| < 700 to about 1e-6, of the same bits on every machine: libm's own depends on the
// processor. 2^k times a Taylor polynomial on [-ln 2 / 2, ln 2 / 2].
AMHEX_HD inline double SteadyExp(double x) {
  constexpr double kLog2E = 1.4426950408889634, kLn2 = 0.6931471805599453;
  const int64_t k = static_cast<int64_t>(x * kLog2E + (x >= 0 ? 0.5 : -0.5));
  const double r = x - static_cast<double>(k) * kLn2;
  const double series =
      1 + r * (1 + r * (1.0 / 2 + r * (1.0 / 6 + r * (1.0 / 24 + r * (1.0 / 120 + r / 720)))));
  return series * std::bit_cast<double>((k + 1023) << 52);
}

// Exponents below this are not worth evaluating.
inline constexpr double kNegligibleExponent = -6.0;
// Above this the exponential goes on as a straight line.
inline constexpr double kMaxExponent = 30.0;

AMHEX_HD inline double CornerEnergy(double s, const CornerPenalty& penalty) {
  const double deficit = 1 - s;
  const double exponent = penalty.steepness * (penalty.knee - s);
  if (!(exponent >= kNegligibleExponent)) return deficit * deficit;
  if (exponent < kMaxExponent) return deficit * deficit + SteadyExp(exponent);
  return deficit * deficit + SteadyExp(kMaxExponent) * (1 + exponent - kMaxExponent);
}

// First and second derivative.
struct Slopes {
  double first = 0;
  double second = 0;
};
AMHEX_HD inline Slopes CornerSlopes(double s, const CornerPenalty& penalty) {
  const double exponent = penalty.steepness * (penalty.knee - s);
  Slopes slopes{-2 * (1 - s), 2};
  if (exponent >= kMaxExponent) {
    slopes.first -= penalty.steepness * SteadyExp(kMaxExponent);
  } else if (exponent >= kNegligibleExponent) {
    const double slope = penalty.steepness * SteadyExp(exponent);
    slopes.first -= slope;
    slopes.second += penalty.steepness * slope;
  }
  return slopes;
}

// x^(2^n) and its inverse, which make a norm of order 2^n. Square roots are exact to the bit on
// every processor.
AMHEX_HD inline double SquaredTimes(double x, int n) {
  for (int i = 0; i < n; ++i) x *= x;
  return x;
}
AMHEX_HD inline double RootedTimes(double x, int n) {
  for (int i = 0; i < n; ++i) x = std::sqrt(x);
  return x;
}

// Cells with a smaller fold margin (a cube has 0.5, a regular tetrahedron 0.18) are watched, with a
// penalty that grows by a factor of e for every scale that the margin falls.
inline constexpr double kNearFolding = 0.04;
inline constexpr double kFoldScale = 0.008;
inline constexpr double kFoldWeight = 3.0;
inline constexpr double kMaxFoldExponent = 12.0;
AMHEX_HD inline double FoldEnergy(double margin) {
  return kFoldWeight * SteadyExp(Smaller(-margin / kFoldScale, kMaxFoldExponent)) - margin;
}
AMHEX_HD inline Slopes FoldSlopes(double margin) {
  const double exponent = -margin / kFoldScale;
  if (exponent > kMaxFoldExponent) return {-1, 0};
  const double slope = kFoldWeight / kFoldScale * SteadyExp(exponent);
  return {-slope - 1, slope / kFoldScale};
}

}  // namespace amhex
