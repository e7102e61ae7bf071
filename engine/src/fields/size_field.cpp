#include "fields/size_field.h"

#include <algorithm>
#include <cmath>

#include "fields/conjugate_gradient.h"

namespace amhex::fields {
namespace {

// A change of an axis' length along that axis is almost free: it costs this share.
constexpr double kAlongOwnAxis = 0.1;
// Fixes the common constant; small against the edge weights, whose sum is about ten.
constexpr float kRegularization = 1e-3F;

using Gradients = std::vector<std::array<Vec3f, 3>>;  // [node_count][axis]

Vec3f ToFloat(const Vec3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

// Axes of the neighbour's frame in the order and with the signs of the node's own.
AxisFrame RenamedFrame(const Quaternion& frame, const AxisRotation& rotation) {
  const AxisFrame own = ToFrame(frame);
  AxisFrame renamed;
  for (int k = 0; k < 3; ++k) renamed.axis[k] = own.axis[rotation.source[k]] * rotation.sign[k];
  return renamed;
}

// f_a x curl f_a by differences over the six axis neighbours, no longer than the limit.
std::array<Vec3f, 3> GradientsAt(const BackgroundGrid& grid, const std::vector<Quaternion>& frames,
                                 const ForwardCodes& codes, double limit, int64_t node) {
  const GridLevel& level = grid.fine();
  const AxisFrame frame = ToFrame(frames[node]);
  std::array<Vec3d, 3> curl;
  for (int d = 0; d < 3; ++d) {
    const int32_t next = level.neighbours[node][d];
    const int32_t previous = level.neighbours[node][Opposite(d)];
    if (next < 0 && previous < 0) continue;
    AxisFrame ahead = frame, behind = frame;
    if (next >= 0) ahead = RenamedFrame(frames[next], RotationFrom(level, codes, node, d));
    if (previous >= 0) {
      behind = RenamedFrame(frames[previous], RotationFrom(level, codes, node, Opposite(d)));
    }
    const double width = grid.spacing * ((next >= 0 ? 1 : 0) + (previous >= 0 ? 1 : 0));
    Vec3d unit;
    unit[d] = 1;
    for (int a = 0; a < 3; ++a) {
      curl[a] += Cross(unit, (ahead.axis[a] - behind.axis[a]) / width);
    }
  }
  std::array<Vec3f, 3> gradients;
  for (int a = 0; a < 3; ++a) {
    Vec3d gradient = Cross(frame.axis[a], curl[a]);
    const double length = Norm(gradient);
    if (length > limit) gradient *= limit / length;
    gradients[a] = ToFloat(gradient);
  }
  return gradients;
}

// The sum over edges of w (s_a(i) - s_b(j) + mean gradient . (x_j - x_i))^2, b the axis of j that
// a of i turns into.
class SizeSystem {
 public:
  SizeSystem(const BackgroundGrid& grid, const std::vector<Quaternion>& frames,
             const ForwardCodes& codes, const RunContext& run)
      : level_(grid.fine()), codes_(codes), run_(run), spacing_(grid.spacing) {
    weights_.resize(level_.count());
    ForEach(run, level_.count(), [&](int64_t i) { SetWeights(frames, i); });
  }

  void Apply(const std::vector<float>& x, std::vector<float>& product) const {
    ForEach(run_, level_.count(), [&](int64_t i) {
      std::array<float, 3> sum;
      for (int a = 0; a < 3; ++a) sum[a] = kRegularization * x[3 * i + a];
      VisitEdges(i, [&](int32_t j, const AxisRotation& rotation, const float* weight, int) {
        for (int a = 0; a < 3; ++a) {
          sum[a] += weight[a] * (x[3 * i + a] - x[3 * int64_t{j} + rotation.source[a]]);
        }
      });
      for (int a = 0; a < 3; ++a) product[3 * i + a] = sum[a];
    });
  }

  std::vector<float> Diagonal() const {
    std::vector<float> diagonal(3 * level_.count(), kRegularization);
    ForEach(run_, level_.count(), [&](int64_t i) {
      VisitEdges(i, [&](int32_t, const AxisRotation&, const float* weight, int) {
        for (int a = 0; a < 3; ++a) diagonal[3 * i + a] += weight[a];
      });
    });
    return diagonal;
  }

  std::vector<float> RightSide(const Gradients& gradients) const {
    std::vector<float> rhs(3 * level_.count(), 0.0F);
    ForEach(run_, level_.count(), [&](int64_t i) {
      VisitEdges(i, [&](int32_t j, const AxisRotation& rotation, const float* weight, int k) {
        const std::array<int, 3>& offset = kNeighbourOffsets[k];
        const Vec3f step = ToFloat(Vec3d{double(offset[0]), double(offset[1]), double(offset[2])} *
                                   (spacing_ / 2));
        for (int a = 0; a < 3; ++a) {
          const Vec3f sum = gradients[i][a] + gradients[j][rotation.source[a]];
          rhs[3 * i + a] -= weight[a] * Dot(sum, step);
        }
      });
    });
    return rhs;
  }

 private:
  // visit(neighbour, rotation to i, weights by axis of i, neighbour index).
  template <class Visit>
  void VisitEdges(int64_t i, const Visit& visit) const {
    for (int k = 0; k < kNeighbourCount; ++k) {
      const int32_t j = level_.neighbours[i][k];
      if (j < 0) continue;
      const AxisRotation& rotation = RotationFrom(level_, codes_, i, k);
      if (k < kForwardCount) {
        visit(j, rotation, weights_[i][k].data(), k);
        continue;
      }
      const std::array<float, 3>& theirs = weights_[j][k - kForwardCount];
      const std::array<float, 3> mine{theirs[rotation.source[0]], theirs[rotation.source[1]],
                                      theirs[rotation.source[2]]};
      visit(j, rotation, mine.data(), k);
    }
  }

  // Both ends' weights, summed: the edge counts once from each side.
  void SetWeights(const std::vector<Quaternion>& frames, int64_t i) {
    const AxisFrame own = ToFrame(frames[i]);
    for (int k = 0; k < kForwardCount; ++k) {
      const int32_t j = level_.neighbours[i][k];
      if (j < 0) continue;
      const AxisFrame other = RenamedFrame(frames[j], AxisRotations()[codes_[i][k]]);
      const std::array<int, 3>& offset = kNeighbourOffsets[k];
      const Vec3d edge = Normalized(Vec3d{double(offset[0]), double(offset[1]), double(offset[2])});
      const double base = IsAxisNeighbour(k) ? kAxisWeight : kDiagonalWeight;
      for (int a = 0; a < 3; ++a) {
        const double c0 = Dot(own.axis[a], edge), c1 = Dot(other.axis[a], edge);
        // The neighbour's own axis number does not matter here: `other` is renamed.
        weights_[i][k][a] =
            static_cast<float>(base * (2 * (1 + kAlongOwnAxis) - c0 * c0 - c1 * c1));
      }
    }
  }

  const GridLevel& level_;
  const ForwardCodes& codes_;
  const RunContext& run_;
  double spacing_;
  std::vector<std::array<std::array<float, 3>, kForwardCount>> weights_;
};

// Lengths from logarithms: centred, clamped, then rescaled so that cells keep their mean volume.
std::vector<Vec3d> LengthsFromLogarithms(const std::vector<float>& s, const SizeSettings& settings,
                                         const RunContext& run) {
  const auto count = static_cast<int64_t>(s.size() / 3);
  const double total =
      DeterministicSum(run, static_cast<int64_t>(s.size()), [&](int64_t begin, int64_t end) {
        double sum = 0;
        for (int64_t i = begin; i < end; ++i) sum += s[i];
        return sum;
      });
  const double mean = total / static_cast<double>(s.size());
  const double low = std::log(settings.min_size), high = std::log(settings.max_size);
  std::vector<Vec3d> sizes(count);
  const double density = DeterministicSum(run, count, [&](int64_t begin, int64_t end) {
    double sum = 0;
    for (int64_t i = begin; i < end; ++i) {
      for (int a = 0; a < 3; ++a) {
        sizes[i][a] = std::exp(std::clamp(s[3 * i + a] - mean, low, high));
      }
      sum += 1 / (sizes[i].x * sizes[i].y * sizes[i].z);
    }
    return sum;
  });
  const double scale = std::cbrt(density / static_cast<double>(count));
  ForEach(run, count, [&](int64_t i) { sizes[i] *= scale; });
  return sizes;
}

}  // namespace

absl::StatusOr<std::vector<Vec3d>> SolveSizeField(const BackgroundGrid& grid,
                                                  const std::vector<Quaternion>& frames,
                                                  const ForwardCodes& codes,
                                                  const SizeSettings& settings,
                                                  const ProgressSlice& slice) {
  const RunContext& run = slice.run();
  const SizeSystem system(grid, frames, codes, run);
  std::vector<float> rhs;
  {
    Gradients gradients(grid.count());
    ForEach(run, grid.count(), [&](int64_t i) {
      gradients[i] = GradientsAt(grid, frames, codes, settings.gradient_limit, i);
    });
    rhs = system.RightSide(gradients);
  }
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  slice.Report(0.3);
  const LinearSystem linear{
      [&](const std::vector<float>& x, std::vector<float>& product) { system.Apply(x, product); },
      system.Diagonal()};
  std::vector<float> s(rhs.size(), 0.0F);
  const absl::StatusOr<int> iterations =
      SolveConjugateGradient(linear, rhs, {settings.max_iterations, settings.tolerance}, run, &s);
  if (!iterations.ok()) return iterations.status();
  std::vector<Vec3d> sizes = LengthsFromLogarithms(s, settings, run);
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  slice.Report(1.0);
  return sizes;
}

}  // namespace amhex::fields
