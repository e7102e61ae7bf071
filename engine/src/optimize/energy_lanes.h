// The penalties of cell_energy.h for lanes of scaled Jacobians, with the same bits. For use inside
// of RunWithWidestVectors (base/vector_lanes.h).
#pragma once

#include "base/vector_lanes.h"
#include "optimize/cell_energy.h"

namespace amhex {

struct SlopeLanes {
  DoubleLanes first, second;
};

AMHEX_LANES_INLINE DoubleLanes SteadyExp(const DoubleLanes& x) {
  constexpr double kLog2E = 1.4426950408889634, kLn2 = 0.6931471805599453;
  const DoubleLanes half = x >= 0 ? DoubleLanes{} + 0.5 : DoubleLanes{} - 0.5;
  const LaneMask k = __builtin_convertvector(x * kLog2E + half, LaneMask);
  const DoubleLanes r = x - __builtin_convertvector(k, DoubleLanes) * kLn2;
  const DoubleLanes series =
      1 + r * (1 + r * (1.0 / 2 + r * (1.0 / 6 + r * (1.0 / 24 + r * (1.0 / 120 + r / 720)))));
  return series * reinterpret_cast<DoubleLanes>((k + 1023) << 52);
}

// Where the exponential goes on as a straight line, and where it is not worth evaluating, its value
// at the nearer end is as good as any.
AMHEX_LANES_INLINE DoubleLanes EvaluatedExponent(const DoubleLanes& exponent) {
  const DoubleLanes least =
      exponent >= kNegligibleExponent ? exponent : DoubleLanes{} + kNegligibleExponent;
  return least < kMaxExponent ? least : DoubleLanes{} + kMaxExponent;
}

AMHEX_LANES_INLINE DoubleLanes CornerEnergy(const DoubleLanes& s, const CornerPenalty& penalty) {
  const DoubleLanes deficit = 1 - s;
  const DoubleLanes square = deficit * deficit;
  const DoubleLanes exponent = penalty.steepness * (penalty.knee - s);
  const LaneMask counts = exponent >= kNegligibleExponent;
  if (!AnyLane(counts)) return square;
  const DoubleLanes raised = SteadyExp(EvaluatedExponent(exponent));
  const DoubleLanes straight = 1 + exponent - kMaxExponent;
  const DoubleLanes steep = exponent < kMaxExponent ? raised : raised * straight;
  return counts ? square + steep : square;
}

AMHEX_LANES_INLINE SlopeLanes CornerSlopes(const DoubleLanes& s, const CornerPenalty& penalty) {
  const DoubleLanes exponent = penalty.steepness * (penalty.knee - s);
  const DoubleLanes two = DoubleLanes{} + 2;
  SlopeLanes slopes{-2 * (1 - s), two};
  const LaneMask counts = exponent >= kNegligibleExponent;
  if (!AnyLane(counts)) return slopes;
  const DoubleLanes slope = penalty.steepness * SteadyExp(EvaluatedExponent(exponent));
  slopes.first = counts ? slopes.first - slope : slopes.first;
  slopes.second = (counts & (exponent < kMaxExponent)) ? two + penalty.steepness * slope : two;
  return slopes;
}

AMHEX_LANES_INLINE DoubleLanes SquaredTimes(DoubleLanes x, int n) {
  for (int i = 0; i < n; ++i) x *= x;
  return x;
}
AMHEX_LANES_INLINE DoubleLanes RootedTimes(DoubleLanes x, int n) {
  for (int i = 0; i < n; ++i) x = SquareRoot(x);
  return x;
}

}  // namespace amhex
