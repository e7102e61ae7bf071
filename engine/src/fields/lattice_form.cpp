#include "fields/lattice_form.h"

#include <optional>
#include <utility>

#include "fields/conjugate_gradient.h"
#include "fields/frame_lanes.h"
#include "fields/hull_edges.h"
#include "fields/lattice_jacobian.h"
#include "fields/node_links.h"

namespace amhex::fields {
namespace {

// Cells along the node's axes per step `d` of the grid.
Vec3d OwnIncrement(const Quaternion& frame, const Vec3d& size, int d, double spacing) {
  const AxisFrame axes = ToFrame(frame);
  return {axes.axis[0][d] * spacing / size.x, axes.axis[1][d] * spacing / size.y,
          axes.axis[2][d] * spacing / size.z};
}

// Mean of what the two ends of each edge expect.
Increments ExpectedIncrements(const BackgroundGrid& grid, const std::vector<Quaternion>& frames,
                              const std::vector<Vec3d>& sizes, const ForwardCodes& codes,
                              const RunContext& run) {
  Increments increments(grid.count());
  ForEach(run, grid.count(), [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      const int32_t j = grid.fine().neighbours[i][d];
      if (j < 0) continue;
      const Vec3d here = OwnIncrement(frames[i], sizes[i], d, grid.spacing);
      const Vec3d there =
          kAxisRotations[codes[i][d]].Apply(OwnIncrement(frames[j], sizes[j], d, grid.spacing));
      const Vec3d mean = (here + there) * 0.5;
      increments[i][d] = {static_cast<float>(mean.x), static_cast<float>(mean.y),
                          static_cast<float>(mean.z)};
    }
  });
  return increments;
}

// The operator W + K C^T C on flat vectors of nine numbers per node; C = curl around the regular
// squares, W = weight of the correction, larger on edges that follow the hull.
class ClosureSystem {
 public:
  ClosureSystem(const GridLevel& level, const ForwardCodes& codes, const LatticeSettings& settings,
                std::vector<uint16_t> follows, const RunContext& run)
      : level_(level),
        codes_(codes),
        weight_(static_cast<float>(settings.closure_weight)),
        hull_weight_(static_cast<float>(settings.hull_edge_weight)),
        follows_(std::move(follows)),
        run_(run),
        is_regular_(level.count(), 0) {
    ForEach(run, level.count(), [&](int64_t i) {
      for (int d = 0; d < 3; ++d) {
        if (IsRegularSquare(level, codes, i, d)) {
          is_regular_[i] = static_cast<uint8_t>(is_regular_[i] | 1U << d);
        }
      }
    });
  }

  void Curls(const Increments& x, Increments* curls) const {
    ForEach(run_, level_.count(), [&](int64_t i) {
      for (int d = 0; d < 3; ++d) {
        (*curls)[i][d] = IsRegular(i, d) ? CurlAround(level_, codes_, x, i, d) : Vec3f{};
      }
    });
  }

  // C^T curls at one edge: the edge is the first or last leg of two squares of its own node, and
  // an opposite leg of a square of two backward neighbours.
  Vec3f Adjoint(const Increments& curls, int64_t i, int d) const {
    const int before = (d + 2) % 3, after = (d + 1) % 3;
    Vec3f sum = curls[i][d] - curls[i][before];
    if (const int32_t j = level_.neighbours[i][Opposite(before)]; j >= 0) {
      sum += kAxisRotations[codes_[j][before]].ApplyInverse(curls[j][before]);
    }
    if (const int32_t j = level_.neighbours[i][Opposite(after)]; j >= 0) {
      sum -= kAxisRotations[codes_[j][after]].ApplyInverse(curls[j][d]);
    }
    return sum;
  }

  // W times the correction of one edge.
  Vec3f Weighted(int64_t i, int d, Vec3f correction) const {
    for (int a = 0; a < 3; ++a) {
      if (Follows(follows_, i, d, a)) correction[a] *= hull_weight_;
    }
    return correction;
  }

  // W plus K per square that the edge bounds.
  Vec3f DiagonalAt(int64_t i, int d) const {
    const int before = (d + 2) % 3, after = (d + 1) % 3;
    int squares = (IsRegular(i, d) ? 1 : 0) + (IsRegular(i, before) ? 1 : 0);
    if (const int32_t j = level_.neighbours[i][Opposite(before)]; j >= 0) {
      squares += IsRegular(j, before) ? 1 : 0;
    }
    if (const int32_t j = level_.neighbours[i][Opposite(after)]; j >= 0) {
      squares += IsRegular(j, d) ? 1 : 0;
    }
    const float closing = weight_ * static_cast<float>(squares);
    return Weighted(i, d, {1, 1, 1}) + Vec3f{closing, closing, closing};
  }

  // product = W x + K C^T C x on flat vectors; `curls` is room for C x. The same operations as
  // above, in lanes.
  void Apply(const std::vector<float>& x, std::vector<float>* curls,
             std::vector<float>* product) const {
    const float* from = x.data();
    float* curl = curls->data();
    float* to = product->data();
    ForEachInLanes(run_, level_.count(), [&](int64_t i) {
      for (int d = 0; d < 3; ++d) {
        StoreAxes(IsRegular(i, d) ? CurlLanes(from, i, d) : AxisLanes{}, curl + 9 * i + 3 * d);
      }
    });
    ForEachInLanes(run_, level_.count(), [&](int64_t i) {
      for (int d = 0; d < 3; ++d) {
        const int64_t at = 9 * i + 3 * d;
        StoreAxes(WeightLanes(i, d) * LoadAxes(from + at) + AdjointLanes(curl, i, d) * weight_,
                  to + at);
      }
    });
  }

  // The same for a device, on this system's arrays.
  ClosureOperator Matrix(const NodeLinks& links) const {
    return {links,
            {is_regular_.data(), level_.count()},
            {follows_.data(), level_.count()},
            weight_,
            hull_weight_};
  }
  OwnedLinks Links() const { return OwnedLinks(level_, codes_, run_); }

  bool IsRegular(int64_t i, int d) const { return (is_regular_[i] >> d & 1) != 0; }
  float weight() const { return weight_; }

 private:
  AMHEX_LANES_INLINE AxisLanes CurlLanes(const float* x, int64_t i, int d) const {
    const int e = (d + 1) % 3;
    const int64_t a = level_.neighbours[i][d], b = level_.neighbours[i][e];
    return LoadAxes(x + 9 * i + 3 * d) +
           Applied(rotations_[codes_[i][d]], LoadAxes(x + 9 * a + 3 * e)) -
           Applied(rotations_[codes_[i][e]], LoadAxes(x + 9 * b + 3 * d)) -
           LoadAxes(x + 9 * i + 3 * e);
  }
  AMHEX_LANES_INLINE AxisLanes AdjointLanes(const float* curls, int64_t i, int d) const {
    const int before = (d + 2) % 3, after = (d + 1) % 3;
    AxisLanes sum = LoadAxes(curls + 9 * i + 3 * d) - LoadAxes(curls + 9 * i + 3 * before);
    if (const int64_t j = level_.neighbours[i][Opposite(before)]; j >= 0) {
      sum += InverseApplied(rotations_[codes_[j][before]], LoadAxes(curls + 9 * j + 3 * before));
    }
    if (const int64_t j = level_.neighbours[i][Opposite(after)]; j >= 0) {
      sum -= InverseApplied(rotations_[codes_[j][after]], LoadAxes(curls + 9 * j + 3 * d));
    }
    return sum;
  }
  AMHEX_LANES_INLINE AxisLanes WeightLanes(int64_t i, int d) const {
    AxisLanes weight = {1, 1, 1, 1};
    if (follows_[i] == 0) return weight;
    for (int a = 0; a < 3; ++a) {
      if (Follows(follows_, i, d, a)) weight[a] = hull_weight_;
    }
    return weight;
  }

  const GridLevel& level_;
  const ForwardCodes& codes_;
  const std::array<LaneRotation, kRotationCount>& rotations_ = LaneRotations();
  float weight_;
  float hull_weight_;
  std::vector<uint16_t> follows_;
  const RunContext& run_;
  std::vector<uint8_t> is_regular_;  // bit d: square d of the node
};

void Unflatten(const std::vector<float>& flat, const RunContext& run, Increments* increments) {
  ForEach(run, static_cast<int64_t>(increments->size()), [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      const float* from = &flat[9 * i + 3 * d];
      (*increments)[i][d] = {from[0], from[1], from[2]};
    }
  });
}

template <class Value>
void Flatten(const RunContext& run, int64_t count, const Value& value, std::vector<float>* flat) {
  ForEach(run, count, [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      const Vec3f v = value(i, d);
      float* to = &(*flat)[9 * i + 3 * d];
      to[0] = v.x, to[1] = v.y, to[2] = v.z;
    }
  });
}

absl::Status CloseIncrements(const ClosureSystem& closure, const LatticeSettings& settings,
                             const RunContext& run, Increments* increments) {
  const auto count = static_cast<int64_t>(increments->size());
  const float weight = closure.weight();
  Increments scratch(count), curls(count);
  std::vector<float> rhs(9 * count), correction(9 * count, 0.0F);
  LinearSystem system;
  system.diagonal.resize(9 * count);
  Flatten(
      run, count, [&](int64_t i, int d) { return closure.DiagonalAt(i, d); }, &system.diagonal);
  closure.Curls(*increments, &curls);
  Flatten(
      run, count, [&](int64_t i, int d) { return closure.Adjoint(curls, i, d) * -weight; }, &rhs);
  std::vector<float> curl_lanes(9 * count);
  system.apply = [&](const std::vector<float>& x, std::vector<float>& product) {
    closure.Apply(x, &curl_lanes, &product);
  };
  std::optional<OwnedLinks> links;
  if (settings.device != nullptr) {
    system.device = settings.device;
    system.matrix = closure.Matrix(links.emplace(closure.Links()).View());
  }
  const absl::StatusOr<int> iterations = SolveConjugateGradient(
      system, rhs, {settings.max_iterations, settings.tolerance}, run, &correction);
  if (!iterations.ok()) return iterations.status();
  Unflatten(correction, run, &scratch);
  ForEach(run, count, [&](int64_t i) {
    for (int d = 0; d < 3; ++d) (*increments)[i][d] += scratch[i][d];
  });
  return run.CheckStop();
}

}  // namespace

bool IsRegularSquare(const GridLevel& level, const ForwardCodes& codes, int64_t node, int d) {
  const int e = (d + 1) % 3;
  const int32_t a = level.neighbours[node][d], b = level.neighbours[node][e];
  if (a < 0 || b < 0 || level.neighbours[a][e] < 0) return false;
  return Compose(kAxisRotations[codes[node][d]], kAxisRotations[codes[a][e]]) ==
         Compose(kAxisRotations[codes[node][e]], kAxisRotations[codes[b][d]]);
}

Vec3f CurlAround(const GridLevel& level, const ForwardCodes& codes, const Increments& increments,
                 int64_t node, int d) {
  const int e = (d + 1) % 3;
  const int32_t a = level.neighbours[node][d], b = level.neighbours[node][e];
  return increments[node][d] + kAxisRotations[codes[node][d]].Apply(increments[a][e]) -
         kAxisRotations[codes[node][e]].Apply(increments[b][d]) - increments[node][e];
}

absl::StatusOr<LatticeForm> SolveLatticeForm(const BackgroundGrid& grid,
                                             const std::vector<Quaternion>& frames,
                                             const std::vector<Vec3d>& sizes,
                                             const ForwardCodes& codes,
                                             const LatticeSettings& settings,
                                             const ProgressSlice& slice) {
  const RunContext& run = slice.run();
  LatticeForm form;
  form.increments = ExpectedIncrements(grid, frames, sizes, codes, run);
  {
    const ClosureSystem closure(grid.fine(), codes, settings,
                                FollowHull({grid, frames, sizes, codes}, run, &form.increments),
                                run);
    if (absl::Status s = CloseIncrements(closure, settings, run, &form.increments); !s.ok()) {
      return s;
    }
  }
  slice.Report(0.9);
  form.frames = frames;
  form.sizes = sizes;
  RecoverFrames(grid, codes, settings.density, run, &form);
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  slice.Report(1.0);
  return form;
}

}  // namespace amhex::fields
