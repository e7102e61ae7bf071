// How good a cell of known pattern is and how far from folding; usable where bodies run. What is
// measured: cell_quality.h.
#pragma once

#include <array>
#include <cmath>

#include "amhex/vec3.h"
#include "base/platform.h"
#include "base/widest_vectors.h"
#include "optimize/cell_pattern.h"

namespace amhex {

using CellPositions = std::array<Vec3d, 8>;  // by slot
using CornerJacobians = std::array<double, 8>;

// The least determinant of the trilinear map's derivative at its 2x2x2 Gauss points. The twelve
// half-interpolated edges: along axis x the derivative depends on y and z only, so four vectors per
// axis serve all eight points.
class GaussJacobians {
 public:
  AMHEX_HD explicit GaussJacobians(const CellPositions& p) {
    Fill({p[1] - p[0], p[2] - p[3], p[5] - p[4], p[6] - p[7]}, du_);
    Fill({p[3] - p[0], p[2] - p[1], p[7] - p[4], p[6] - p[5]}, dv_);
    Fill({p[4] - p[0], p[5] - p[1], p[7] - p[3], p[6] - p[2]}, dw_);
  }
  AMHEX_HD double Minimum() const {
    double minimum = 1e300;
    for (int i = 0; i < 8; ++i) {
      const int u = i & 1, v = i >> 1 & 1, w = i >> 2;
      minimum = Lesser(minimum, Determinant(du_[v + 2 * w], dv_[u + 2 * w], dw_[u + 2 * v]));
    }
    return minimum;
  }
  // The second only where it is less: what is not a number changes nothing.
  AMHEX_HD static double Lesser(double a, double b) { return b < a ? b : a; }

 private:
  // Bilinear interpolation of four parallel edges at the 2x2 Gauss points.
  AMHEX_HD static void Fill(const std::array<Vec3d, 4>& edge, std::array<Vec3d, 4>& at) {
    constexpr double kNear = 0.78867513459481288;  // (1 + 1/sqrt 3) / 2
    constexpr double kFar = 1 - kNear;
    const Vec3d low0 = edge[0] * kNear + edge[1] * kFar, low1 = edge[0] * kFar + edge[1] * kNear;
    const Vec3d high0 = edge[2] * kNear + edge[3] * kFar, high1 = edge[2] * kFar + edge[3] * kNear;
    at[0] = low0 * kNear + high0 * kFar;
    at[1] = low1 * kNear + high1 * kFar;
    at[2] = low0 * kFar + high0 * kNear;
    at[3] = low1 * kFar + high1 * kNear;
  }
  std::array<Vec3d, 4> du_, dv_, dw_;
};

AMHEX_HD inline double MinimumStarDeterminant(const CellPattern& pattern, const CellPositions& p) {
  Vec3d centre;
  for (int i = 0; i < pattern.vertex_count; ++i) centre += p[pattern.vertex_slot[i]];
  centre /= pattern.vertex_count;
  CellPositions arm;
  for (int slot = 0; slot < 8; ++slot) arm[slot] = p[slot] - centre;
  double minimum = 1e300;
  for (int i = 0; i < pattern.triangle_count; ++i) {
    const auto& t = pattern.triangle_slots[i];
    minimum = GaussJacobians::Lesser(minimum, Determinant(arm[t[0]], arm[t[1]], arm[t[2]]));
  }
  return minimum;
}

// In whatever registers the caller is compiled for; for most callers ScaledJacobians below.
AMHEX_HD inline void JacobiansOf(const CellPattern& pattern, const CellPositions& positions,
                                 CornerJacobians& jacobians) {
  constexpr double kTiny = 1e-300;
  // Edge vectors as arrays of components, always twelve, so that the square roots and divisions
  // run side by side.
  alignas(64) std::array<double, 12> x{}, y{}, z{};
  for (int e = 0; e < pattern.edge_count; ++e) {
    const auto& slots = pattern.edge_slots[e];
    const Vec3d edge = positions[slots[1]] - positions[slots[0]];
    x[e] = edge.x, y[e] = edge.y, z[e] = edge.z;
  }
  for (int e = 0; e < 12; ++e) {
    const double length = std::sqrt(x[e] * x[e] + y[e] * y[e] + z[e] * z[e]);
    // A zero edge stays zero; dividing by the least normal number keeps it so without a branch.
    const double inverse = 1 / (length < kTiny ? kTiny : length);
    x[e] *= inverse, y[e] *= inverse, z[e] *= inverse;
  }
  for (int i = 0; i < pattern.corner_count; ++i) {
    const CellPattern::Corner& corner = pattern.corner[i];
    const int a = corner.edge[0], b = corner.edge[1], c = corner.edge[2];
    const double determinant = x[a] * (y[b] * z[c] - z[b] * y[c]) +
                               y[a] * (z[b] * x[c] - x[b] * z[c]) +
                               z[a] * (x[b] * y[c] - y[b] * x[c]);
    jacobians[i] = corner.sign * determinant;
  }
}

// Likewise; for most callers FoldMargin below.
AMHEX_HD inline double MarginOf(const CellPattern& pattern, const CellPositions& positions) {
  // Determinants must exceed this fraction of the cell's mean edge length cubed: far above the
  // rounding of later passes over the same vertices in other units, far below any useful cell.
  constexpr double kSmallestDeterminant = 1e-7;
  double length_sum = 0;
  for (int e = 0; e < pattern.edge_count; ++e) {
    const auto& slots = pattern.edge_slots[e];
    length_sum += Norm(positions[slots[1]] - positions[slots[0]]);
  }
  const double mean_length = length_sum / pattern.edge_count;
  const double unit = mean_length * mean_length * mean_length;
  double determinant = GaussJacobians(positions).Minimum();
  if (pattern.type != PrimitiveType::kSlice) {
    determinant = GaussJacobians::Lesser(determinant, MinimumStarDeterminant(pattern, positions));
  }
  const double margin = determinant / unit - kSmallestDeterminant;
  return std::isfinite(margin) ? margin : -1.0;
}

// Scaled Jacobians of pattern.corner[0 .. corner_count), NaN where corners are not finite.
AMHEX_HD inline void ScaledJacobians(const CellPattern& pattern, const CellPositions& positions,
                                     CornerJacobians& jacobians) {
  RunWithWidestVectors([&] { JacobiansOf(pattern, positions, jacobians); });
}

// The least Gauss point or face triangle determinant in units of the mean edge length cubed, less
// a margin: positive where the cell does not fold.
AMHEX_HD inline double FoldMargin(const CellPattern& pattern, const CellPositions& positions) {
  double margin = 0;
  RunWithWidestVectors([&] { margin = MarginOf(pattern, positions); });
  return margin;
}

}  // namespace amhex
