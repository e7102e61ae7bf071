// The steps, frames and sizes of a lattice form from its closed increments, node by node; usable
// where bodies run.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "base/array_view.h"
#include "fields/frame_math.h"
#include "fields/linear_operators.h"
#include "fields/quartic_form.h"
#include "fields/sum_blocks.h"

namespace amhex::fields {

// The ways in space of one cell along each axis.
using CellSteps = std::array<Vec3d, 3>;

// What a form was made of: the expectation that replaces a degenerate Jacobian. Views do not own.
struct ExpectedView {
  ArrayView<const Quaternion> frames;
  ArrayView<const Vec3d> sizes;
  double spacing = 0;  // of the grid
};

// The arrays of a LatticeForm. Where nobody asks for the increments there are none.
struct FormView {
  ArrayView<float> increments;  // [node][d][axis]
  ArrayView<CellSteps> steps;
  ArrayView<Quaternion> frames;
  ArrayView<Vec3d> sizes;
};
// Between a node's increments along its edges ahead.
inline constexpr int kIncrements = 9;

// Rows: cells along axis a per edge length of space.
struct LatticeJacobian {
  double at[3][3];

  AMHEX_HD double Determinant() const {
    return at[0][0] * Minor(1, 2) - at[0][1] * Minor(0, 2) + at[0][2] * Minor(0, 1);
  }
  // Its columns.
  AMHEX_HD CellSteps Inverse() const {
    const double determinant =
        Cofactor(0, 0) * at[0][0] + Cofactor(1, 0) * at[1][0] + Cofactor(2, 0) * at[2][0];
    const double reciprocal = 1 / determinant;
    CellSteps columns;
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) columns[j][i] = Cofactor(j, i) * reciprocal;
    }
    return columns;
  }

 private:
  AMHEX_HD double Minor(int b, int c) const { return at[1][b] * at[2][c] - at[1][c] * at[2][b]; }
  AMHEX_HD double Cofactor(int i, int j) const {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    return at[i1][j1] * at[i2][j2] - at[i1][j2] * at[i2][j1];
  }
};

// One element per node.
struct FindStepsBody {
  NodeLinks links;
  ExpectedView expected;
  ArrayView<const float> increments;
  ArrayView<CellSteps> steps;

  AMHEX_HD void operator()(int64_t i) const { steps[i] = JacobianAt(i).Inverse(); }

 private:
  AMHEX_HD LatticeJacobian JacobianAt(int64_t node) const {
    // A Jacobian with less than this share of the expected volume density has collapsed.
    constexpr double kMinDensityShare = 0.15;
    const LatticeJacobian wanted = Expected(node);
    LatticeJacobian jacobian = wanted;
    for (int d = 0; d < 3; ++d) {
      Vec3f sum;
      int edges = 0;
      if (links.Ahead(node, d) >= 0) sum += IncrementAt(node, d), ++edges;
      if (const int64_t j = links.Behind(node, d); j >= 0) {
        const AxisRenaming& renaming = links.RenamingAt(j, d);
        const Vec3f there = IncrementAt(j, d);
        Vec3f here;
        for (int k = 0; k < 3; ++k) here[renaming.source[k]] = renaming.sign[k] * there[k];
        sum += here;
        ++edges;
      }
      if (edges == 0) continue;
      const double scale = 1 / (edges * expected.spacing);
      for (int a = 0; a < 3; ++a) jacobian.at[a][d] = static_cast<double>(sum[a]) * scale;
    }
    const bool collapsed = jacobian.Determinant() < kMinDensityShare * wanted.Determinant();
    return collapsed ? wanted : jacobian;
  }
  AMHEX_HD LatticeJacobian Expected(int64_t node) const {
    const AxisFrame axes = ToFrame(expected.frames[node]);
    LatticeJacobian jacobian;
    for (int a = 0; a < 3; ++a) {
      for (int d = 0; d < 3; ++d) jacobian.at[a][d] = axes.axis[a][d] / expected.sizes[node][a];
    }
    return jacobian;
  }
  AMHEX_HD Vec3f IncrementAt(int64_t node, int d) const {
    const float* const at = increments.data + kIncrements * node + int64_t{3} * d;
    return {at[0], at[1], at[2]};
  }
};

// Cells that a block of nodes would hold; one element per block.
struct SumDensityBody {
  ArrayView<const CellSteps> steps;
  ArrayView<double> partial;
  AMHEX_HD void operator()(int64_t block) const {
    const int64_t begin = block * kSumBlock, end = Smaller(steps.size, begin + kSumBlock);
    double sum = 0;
    for (int64_t i = begin; i < end; ++i) {
      sum += 1 / std::abs(Determinant(steps[i][0], steps[i][1], steps[i][2]));
    }
    partial[block] = sum;
  }
};

// By how much finer all cells must be for the nodes to hold `density` cells per edge length cubed
// on average.
inline double RefinementFor(double density, ArrayView<const double> partial, int64_t node_count) {
  double cells = 0;
  for (int64_t block = 0; block < partial.size; ++block) cells += partial[block];
  return std::cbrt(density * static_cast<double>(node_count) / cells);
}

// From steps, which are rescaled; one element per node.
struct RecoverBody {
  ExpectedView expected;
  double scale = 1;
  FormView form;

  AMHEX_HD void operator()(int64_t i) const {
    // Bounds of a cell's extents, edge lengths.
    constexpr double kMinStep = 0.5;
    constexpr double kMaxStep = 2.0;
    form.frames[i] = FrameOfSteps(form.steps[i], expected.frames[i]);
    for (int a = 0; a < 3; ++a) {
      form.sizes[i][a] = Smaller(Larger(Norm(form.steps[i][a]), kMinStep), kMaxStep) / scale;
      form.steps[i][a] /= scale;
    }
  }

 private:
  // Rotation nearest to the directions of the steps; `fallback` when they are nearly dependent.
  AMHEX_HD static Quaternion FrameOfSteps(const CellSteps& steps, const Quaternion& fallback) {
    AxisFrame frame;
    for (int a = 0; a < 3; ++a) frame.axis[a] = Normalized(steps[a]);
    return NearestRotationMatrix(&frame) ? FromFrame(frame) : fallback;
  }
};

// The same form of another density: the form's equations are linear in the reciprocal sizes.
struct DenserBody {
  double scale = 1;
  FormView form;
  AMHEX_HD void operator()(int64_t i) const {
    for (int a = 0; a < 3; ++a) form.steps[i][a] /= scale, form.sizes[i][a] /= scale;
  }
};
struct ScaleIncrementsBody {
  double scale = 1;
  ArrayView<float> increments;
  AMHEX_HD void operator()(int64_t k) const { increments[k] *= static_cast<float>(scale); }
};

// Cells that are lower where walls are thin (thin_walls.h); one element per node.
struct LowerBody {
  NodeLinks links;
  ArrayView<const int32_t> place_at_hull;  // [node] of its lowering; -1: none
  ArrayView<const Vec3d> lowerings;        // per axis
  FormView form;

  AMHEX_HD void operator()(int64_t i) const {
    const Vec3d here = LoweringOf(i);
    for (int d = 0; d < 3 && !form.increments.empty(); ++d) {
      const int64_t j = links.Ahead(i, d);
      if (j < 0) continue;
      const AxisRenaming& renaming = links.RenamingAt(i, d);
      const Vec3d there = LoweringOf(j);
      for (int a = 0; a < 3; ++a) {
        const double mean = (here[a] + there[renaming.source[a]]) / 2;
        form.increments[kIncrements * i + int64_t{3} * d + a] *= static_cast<float>(mean);
      }
    }
    for (int a = 0; a < 3; ++a) form.steps[i][a] /= here[a], form.sizes[i][a] /= here[a];
  }

 private:
  AMHEX_HD Vec3d LoweringOf(int64_t i) const {
    const int32_t k = place_at_hull[i];
    return k < 0 ? Vec3d{1, 1, 1} : lowerings[k];
  }
};

}  // namespace amhex::fields
