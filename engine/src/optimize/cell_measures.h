// How good a cell of known pattern is and how far from folding; usable where bodies run. What is
// measured: cell_quality.h.
#pragma once

#include <array>
#include <cmath>

#include "amhex/vec3.h"
#include "base/platform.h"
#include "base/widest_vectors.h"
#include "optimize/cell_pattern.h"
#include "optimize/gauss_points.h"

#if !defined(__CUDACC__)
#include "optimize/wide_cell.h"
#endif

namespace amhex {

using CellPositions = std::array<Vec3d, 8>;  // by slot
using CornerJacobians = std::array<double, 8>;

// The least determinant of the trilinear map's derivative at its 2x2x2 Gauss points. The twelve
// half-interpolated edges: along axis x the derivative depends on y and z only, so four vectors per
// axis serve all eight points. Of one cell (Vector is Vec3d) or of lanes of cells.
template <class Vector>
class GaussJacobians {
 public:
  using Positions = std::array<Vector, 8>;
  using Number = decltype(Vector::x);

  AMHEX_LANES_TOO explicit GaussJacobians(const Positions& p) {
    Fill({p[1] - p[0], p[2] - p[3], p[5] - p[4], p[6] - p[7]}, du_);
    Fill({p[3] - p[0], p[2] - p[1], p[7] - p[4], p[6] - p[5]}, dv_);
    Fill({p[4] - p[0], p[5] - p[1], p[7] - p[3], p[6] - p[2]}, dw_);
  }
  // No more than `minimum`.
  AMHEX_LANES_TOO void LowerTo(Number& minimum) const {
    for (int i = 0; i < 8; ++i) {
      const int u = i & 1, v = i >> 1 & 1, w = i >> 2;
      const Number own = Determinant(du_[v + 2 * w], dv_[u + 2 * w], dw_[u + 2 * v]);
      minimum = own < minimum ? own : minimum;
    }
  }

 private:
  // Bilinear interpolation of four parallel edges at the 2x2 Gauss points.
  AMHEX_LANES_TOO static void Fill(const std::array<Vector, 4>& edge, std::array<Vector, 4>& at) {
    constexpr double kNear = kNearGaussPoint, kFar = kFarGaussPoint;
    const Vector low0 = edge[0] * kNear + edge[1] * kFar, low1 = edge[0] * kFar + edge[1] * kNear;
    const Vector high0 = edge[2] * kNear + edge[3] * kFar;
    const Vector high1 = edge[2] * kFar + edge[3] * kNear;
    at[0] = low0 * kNear + high0 * kFar;
    at[1] = low1 * kNear + high1 * kFar;
    at[2] = low0 * kFar + high0 * kNear;
    at[3] = low1 * kFar + high1 * kNear;
  }
  std::array<Vector, 4> du_, dv_, dw_;
};

// The second only where it is less: what is not a number changes nothing.
AMHEX_HD inline double Lesser(double a, double b) { return b < a ? b : a; }

// Lowers `minimum` to the least determinant of a face's triangle, seen from the middle of the cell.
template <class Vector, class Number>
AMHEX_LANES_TOO void LowerToStar(const CellPattern& pattern, const std::array<Vector, 8>& p,
                                 Number& minimum) {
  Vector centre{};
  for (int i = 0; i < pattern.vertex_count; ++i) centre += p[pattern.vertex_slot[i]];
  centre /= pattern.vertex_count;
  std::array<Vector, 8> arm;
  for (int slot = 0; slot < 8; ++slot) arm[slot] = p[slot] - centre;
  for (int i = 0; i < pattern.triangle_count; ++i) {
    const auto& t = pattern.triangle_slots[i];
    const Number own = Determinant(arm[t[0]], arm[t[1]], arm[t[2]]);
    minimum = own < minimum ? own : minimum;
  }
}

// Determinants must exceed this fraction of the cell's mean edge length cubed: far above the
// rounding of later passes over the same vertices in other units, far below any useful cell.
inline constexpr double kSmallestDeterminant = 1e-7;
inline constexpr double kNoDeterminant = 1e300;  // above any

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

AMHEX_HD inline double MarginFrom(double length_sum, int edge_count, double least_determinant) {
  const double mean_length = length_sum / edge_count;
  const double unit = mean_length * mean_length * mean_length;
  const double margin = least_determinant / unit - kSmallestDeterminant;
  return std::isfinite(margin) ? margin : -1.0;
}

// Likewise; for most callers FoldMargin below.
AMHEX_HD inline double MarginOf(const CellPattern& pattern, const CellPositions& positions) {
  double length_sum = 0;
  for (int e = 0; e < pattern.edge_count; ++e) {
    const auto& slots = pattern.edge_slots[e];
    length_sum += Norm(positions[slots[1]] - positions[slots[0]]);
  }
  double determinant = kNoDeterminant;
  GaussJacobians<Vec3d>(positions).LowerTo(determinant);
  if (pattern.type != PrimitiveType::kSlice) LowerToStar(pattern, positions, determinant);
  return MarginFrom(length_sum, pattern.edge_count, determinant);
}

#if defined(__CUDACC__)
// Calls wide(WideCell), or narrow() where registers do not hold eight numbers.
template <class Wide, class Narrow>
AMHEX_HD void MeasureCellInLanes(const CellPattern&, const CellPositions&, const Wide&,
                                 const Narrow& narrow) {
  narrow();
}
#else
template <class Wide, class Narrow>
void MeasureCellInLanes(const CellPattern& pattern, const CellPositions& positions,
                        const Wide& wide, const Narrow& narrow) {
  RunInLanes([&](auto lanes) {
    if constexpr (lanes == kLanes) {
      wide(WideCell(pattern, positions));
    } else {
      narrow();
    }
  });
}
#endif

// Scaled Jacobians of pattern.corner[0 .. corner_count), NaN where corners are not finite.
AMHEX_HD inline void ScaledJacobians(const CellPattern& pattern, const CellPositions& positions,
                                     CornerJacobians& jacobians) {
  MeasureCellInLanes(
      pattern, positions, [&](const auto& cell) { cell.JacobiansTo(jacobians.data()); },
      [&] { JacobiansOf(pattern, positions, jacobians); });
}

// The least Gauss point or face triangle determinant in units of the mean edge length cubed, less
// a margin: positive where the cell does not fold.
AMHEX_HD inline double FoldMargin(const CellPattern& pattern, const CellPositions& positions) {
  double margin = 0;
  MeasureCellInLanes(
      pattern, positions,
      [&](const auto& cell) {
        margin =
            MarginFrom(cell.LengthSum(), pattern.edge_count, cell.LeastDeterminant(kNoDeterminant));
      },
      [&] { margin = MarginOf(pattern, positions); });
  return margin;
}

}  // namespace amhex
