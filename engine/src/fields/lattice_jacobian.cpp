#include "fields/lattice_jacobian.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "fields/quartic_form.h"

namespace amhex::fields {
namespace {

// A Jacobian with less than this share of the expected volume density has collapsed.
constexpr double kMinDensityShare = 0.15;
// Bounds of a cell's extents, edge lengths.
constexpr double kMinStep = 0.5;
constexpr double kMaxStep = 2.0;

Vec3d ToVec3d(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// Rows: cells along axis a per edge length of space.
Eigen::Matrix3d ExpectedJacobian(const Quaternion& frame, const Vec3d& size) {
  const AxisFrame axes = ToFrame(frame);
  Eigen::Matrix3d jacobian;
  for (int a = 0; a < 3; ++a) {
    for (int d = 0; d < 3; ++d) jacobian(a, d) = axes.axis[a][d] / size[a];
  }
  return jacobian;
}

Eigen::Matrix3d JacobianAt(const BackgroundGrid& grid, const ForwardCodes& codes,
                           const LatticeForm& form, int64_t node) {
  const GridLevel& level = grid.fine();
  const Eigen::Matrix3d expected = ExpectedJacobian(form.frames[node], form.sizes[node]);
  Eigen::Matrix3d jacobian = expected;
  for (int d = 0; d < 3; ++d) {
    Vec3f sum;
    int edges = 0;
    if (level.neighbours[node][d] >= 0) sum += form.increments[node][d], ++edges;
    if (const int32_t j = level.neighbours[node][Opposite(d)]; j >= 0) {
      sum += kAxisRotations[codes[j][d]].ApplyInverse(form.increments[j][d]);
      ++edges;
    }
    if (edges == 0) continue;
    const double scale = 1 / (edges * grid.spacing);
    for (int a = 0; a < 3; ++a) jacobian(a, d) = sum[a] * scale;
  }
  const bool collapsed = jacobian.determinant() < kMinDensityShare * expected.determinant();
  return collapsed ? expected : jacobian;
}

// Rotation nearest to the directions of the steps; `fallback` when they are nearly dependent.
Quaternion FrameOfSteps(const std::array<Vec3d, 3>& steps, const Quaternion& fallback) {
  AxisFrame frame;
  for (int a = 0; a < 3; ++a) frame.axis[a] = Normalized(steps[a]);
  return NearestRotationMatrix(&frame) ? FromFrame(frame) : fallback;
}

}  // namespace

void RecoverFrames(const BackgroundGrid& grid, const ForwardCodes& codes, double density,
                   const RunContext& run, LatticeForm* form) {
  const int64_t count = grid.count();
  form->steps.resize(count);
  ForEach(run, count, [&](int64_t i) {
    const Eigen::Matrix3d steps = JacobianAt(grid, codes, *form, i).inverse();
    for (int a = 0; a < 3; ++a) form->steps[i][a] = ToVec3d(steps.col(a));
  });
  const double cells = DeterministicSum(run, count, [&](int64_t begin, int64_t end) {
    double sum = 0;
    for (int64_t i = begin; i < end; ++i) {
      const std::array<Vec3d, 3>& step = form->steps[i];
      sum += 1 / std::abs(Determinant(step[0], step[1], step[2]));
    }
    return sum;
  });
  const double scale = std::cbrt(density * static_cast<double>(count) / cells);
  ForEach(run, count, [&](int64_t i) {
    form->frames[i] = FrameOfSteps(form->steps[i], form->frames[i]);
    for (int a = 0; a < 3; ++a) {
      form->sizes[i][a] = std::clamp(Norm(form->steps[i][a]), kMinStep, kMaxStep) / scale;
      form->steps[i][a] /= scale;
      form->increments[i][a] *= static_cast<float>(scale);
    }
  });
}

}  // namespace amhex::fields
