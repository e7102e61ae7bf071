// The penalties of cell_energy.h for lanes of scaled Jacobians, with the same bits. For use inside
// of RunWithWidestVectors (base/vector_lanes.h).
#pragma once

#include "base/vector_lanes.h"
#include "optimize/cell_energy.h"

namespace amhex {

struct SlopeLanes {
  HalfLanes first, second;
};

AMHEX_LANES_INLINE HalfLanes SteadyExp(const HalfLanes& x) {
  constexpr double kLog2E = 1.4426950408889634, kLn2 = 0.6931471805599453;
  const HalfLanes half = x >= 0 ? HalfLanes{} + 0.5 : HalfLanes{} - 0.5;
  const HalfLanes k = Truncated(x * kLog2E + half);
  const HalfLanes r = x - k * kLn2;
  const HalfLanes series =
      1 + r * (1 + r * (1.0 / 2 + r * (1.0 / 6 + r * (1.0 / 24 + r * (1.0 / 120 + r / 720)))));
  // The last bits of this sum are the integer's.
  const auto integer = reinterpret_cast<HalfMask>(k + 0x1.8p52);
  return series * reinterpret_cast<HalfLanes>((integer + 1023) << 52);
}

// Where the exponential goes on as a straight line, and where it is not worth evaluating, its value
// at the nearer end is as good as any.
AMHEX_LANES_INLINE HalfLanes EvaluatedExponent(const HalfLanes& exponent) {
  const HalfLanes least =
      exponent >= kNegligibleExponent ? exponent : HalfLanes{} + kNegligibleExponent;
  return least < kMaxExponent ? least : HalfLanes{} + kMaxExponent;
}

AMHEX_LANES_INLINE HalfLanes CornerEnergy(const HalfLanes& s, const CornerPenalty& penalty) {
  const HalfLanes deficit = 1 - s;
  const HalfLanes square = deficit * deficit;
  const HalfLanes exponent = penalty.steepness * (penalty.knee - s);
  const HalfMask counts = exponent >= kNegligibleExponent;
  if (!AnyLane(counts)) return square;
  const HalfLanes raised = SteadyExp(EvaluatedExponent(exponent));
  const HalfLanes straight = 1 + exponent - kMaxExponent;
  const HalfLanes steep = exponent < kMaxExponent ? raised : raised * straight;
  return counts ? square + steep : square;
}

AMHEX_LANES_INLINE SlopeLanes CornerSlopes(const HalfLanes& s, const CornerPenalty& penalty) {
  const HalfLanes exponent = penalty.steepness * (penalty.knee - s);
  const HalfLanes two = HalfLanes{} + 2;
  SlopeLanes slopes{-2 * (1 - s), two};
  const HalfMask counts = exponent >= kNegligibleExponent;
  if (!AnyLane(counts)) return slopes;
  const HalfLanes slope = penalty.steepness * SteadyExp(EvaluatedExponent(exponent));
  slopes.first = counts ? slopes.first - slope : slopes.first;
  slopes.second = (counts & (exponent < kMaxExponent)) ? two + penalty.steepness * slope : two;
  return slopes;
}

AMHEX_LANES_INLINE HalfLanes SquaredTimes(HalfLanes x, int n) {
  for (int i = 0; i < n; ++i) x *= x;
  return x;
}
AMHEX_LANES_INLINE HalfLanes RootedTimes(HalfLanes x, int n) {
  for (int i = 0; i < n; ++i) x = SquareRoot(x);
  return x;
}

}  // namespace amhex
