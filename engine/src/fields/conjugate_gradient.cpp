#include "fields/conjugate_gradient.h"

#include <cstdint>
#include <cstring>
#include <variant>

#include "cuda/device_use.h"
#include "fields/field_loops.h"
#include "fields/frame_lanes.h"
#include "fields/gradient_task.h"

namespace amhex::fields {
namespace {

using DoubleQuad = double __attribute__((vector_size(32), aligned(alignof(double))));
using FloatQuad = float __attribute__((vector_size(16), aligned(alignof(float))));

AMHEX_LANES_INLINE FloatQuad Load(const float* from) {
  FloatQuad lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}
AMHEX_LANES_INLINE void Store(const FloatQuad& lanes, float* to) {
  std::memcpy(to, &lanes, sizeof(lanes));
}
AMHEX_LANES_INLINE DoubleQuad ToDoubles(const FloatQuad& lanes) {
  return __builtin_convertvector(lanes, DoubleQuad);
}

// Sum over i in [0, count) of the terms that `term(i)` gives four at a time, in four interleaved
// partial sums per block: fixed order, short dependency. `last_term(i)` gives a single one, for
// what is left of a block.
template <class Term, class LastTerm>
double Sum(const RunContext& run, int64_t count, const Term& term, const LastTerm& last_term) {
  return DeterministicSum(run, count, [&](int64_t begin, int64_t end) {
    DoubleQuad sums{};
    RunWithWidestVectors([&] {
      DoubleQuad partial{};
      int64_t i = begin;
      for (; i + 4 <= end; i += 4) partial += term(i);
      for (; i < end; ++i) partial[0] += last_term(i);
      sums = partial;
    });
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
  });
}

// The arrays of one solve.
class Solve {
 public:
  Solve(const LinearSystem& system, const std::vector<float>& rhs, const RunContext& run,
        std::vector<float>* x)
      : system_(system),
        run_(run),
        count_(static_cast<int64_t>(rhs.size())),
        rhs_(rhs.data()),
        diagonal_(system.diagonal.data()),
        x_(x->data()),
        residual_(rhs.size()),
        direction_(rhs.size()),
        product_(rhs.size()) {
    system_.apply(*x, product_);
  }

  double RightSideNorm() const {
    return Sum(
        run_, count_,
        [&](int64_t i) {
          const DoubleQuad r = ToDoubles(Load(rhs_ + i));
          return r * r / ToDoubles(Load(diagonal_ + i));
        },
        [&](int64_t i) { return static_cast<double>(rhs_[i]) * rhs_[i] / diagonal_[i]; });
  }

  // The residual and the first direction; returns the residual's norm.
  double Start() {
    float *residual = residual_.data(), *direction = direction_.data();
    const float* product = product_.data();
    return Sum(
        run_, count_,
        [&](int64_t i) {
          const FloatQuad r = Load(rhs_ + i) - Load(product + i);
          const FloatQuad d = r / Load(diagonal_ + i);
          Store(r, residual + i);
          Store(d, direction + i);
          return ToDoubles(r) * ToDoubles(d);
        },
        [&](int64_t i) {
          residual[i] = rhs_[i] - product[i];
          direction[i] = residual[i] / diagonal_[i];
          return static_cast<double>(residual[i]) * direction[i];
        });
  }

  double Curvature() {
    system_.apply(direction_, product_);
    const float *direction = direction_.data(), *product = product_.data();
    return Sum(
        run_, count_,
        [&](int64_t i) { return ToDoubles(Load(direction + i)) * ToDoubles(Load(product + i)); },
        [&](int64_t i) { return static_cast<double>(direction[i]) * product[i]; });
  }

  // Moves x along the direction; returns the new residual's norm.
  double Move(float step) {
    float* residual = residual_.data();
    const float *direction = direction_.data(), *product = product_.data();
    return Sum(
        run_, count_,
        [&](int64_t i) {
          Store(Load(x_ + i) + step * Load(direction + i), x_ + i);
          const FloatQuad r = Load(residual + i) - step * Load(product + i);
          Store(r, residual + i);
          return ToDoubles(r) * ToDoubles(r) / ToDoubles(Load(diagonal_ + i));
        },
        [&](int64_t i) {
          x_[i] += step * direction[i];
          residual[i] -= step * product[i];
          return static_cast<double>(residual[i]) * residual[i] / diagonal_[i];
        });
  }

  void Turn(float carry) {
    const float* residual = residual_.data();
    float* direction = direction_.data();
    ForEachInLanes(run_, (count_ + 3) / 4, [&](int64_t quad) {
      const int64_t i = 4 * quad;
      if (i + 4 <= count_) {
        const FloatQuad r = Load(residual + i) / Load(diagonal_ + i);
        Store(r + carry * Load(direction + i), direction + i);
        return;
      }
      for (int64_t k = i; k < count_; ++k) {
        direction[k] = residual[k] / diagonal_[k] + carry * direction[k];
      }
    });
  }

 private:
  const LinearSystem& system_;
  const RunContext& run_;
  const int64_t count_;
  const float* rhs_;
  const float* diagonal_;
  float* x_;
  std::vector<float> residual_, direction_, product_;
};

absl::StatusOr<int> SolveOnCpu(const LinearSystem& system, const std::vector<float>& rhs,
                               const ConjugateGradientLimits& limits, const RunContext& run,
                               std::vector<float>* x) {
  Solve solve(system, rhs, run, x);
  const double goal = limits.tolerance * limits.tolerance * solve.RightSideNorm();
  double norm = solve.Start();
  int iteration = 0;
  for (; iteration < limits.max_iterations && norm > goal; ++iteration) {
    if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
    const double curvature = solve.Curvature();
    if (!(curvature > 0)) break;  // the direction has vanished: nothing left to improve
    const double next_norm = solve.Move(static_cast<float>(norm / curvature));
    solve.Turn(static_cast<float>(next_norm / norm));
    norm = next_norm;
  }
  if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
  return iteration;
}

template <class T>
ArrayView<const T> ViewOf(const std::vector<T>& values) {
  return {values.data(), static_cast<int64_t>(values.size())};
}

}  // namespace

absl::StatusOr<int> SolveConjugateGradient(const LinearSystem& system,
                                           const std::vector<float>& rhs,
                                           const ConjugateGradientLimits& limits,
                                           const RunContext& run, std::vector<float>* x) {
  if (system.device == nullptr) return SolveOnCpu(system, rhs, limits, run, x);
  GradientTask task;
  task.matrix = system.matrix;
  task.resident = system.resident;
  task.node_count = std::visit(
      [&](const auto& matrix) { return ViewOf(rhs).size / matrix.kUnknowns; }, system.matrix);
  task.diagonal = ViewOf(system.diagonal);
  task.right_side = ViewOf(rhs);
  task.x = x;
  task.max_iterations = limits.max_iterations;
  task.tolerance = limits.tolerance;
  task.should_stop = [&run] { return run.ShouldStop(); };
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    const absl::StatusOr<int> iterations = SolveOnCpu(system, rhs, limits, run, x);
    if (!iterations.ok()) return iterations.status();
    task.iterations = *iterations;
    return true;
  };
  const absl::StatusOr<bool> outcome = system.device->Run(&task, on_cpu);
  if (!outcome.ok()) return outcome.status();
  if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
  return task.iterations;
}

}  // namespace amhex::fields
