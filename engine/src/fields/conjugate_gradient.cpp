#include "fields/conjugate_gradient.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>

#include "base/array_view_of.h"
#include "base/vector_lanes.h"
#include "cuda/device_use.h"
#include "fields/gradient_task.h"
#include "fields/sum_blocks.h"

namespace amhex::fields {
namespace {

AMHEX_LANES_INLINE DoubleLanes ToDoubles(const FloatLanes& lanes) {
  return __builtin_convertvector(lanes, DoubleLanes);
}

// Sum over i in [begin, end) of the terms that `term_at(i)` gives eight at a time;
// `last_term_at(i)` gives a single one, for what is left at the end.
template <class Term, class LastTerm>
double SumOfBlock(int64_t begin, int64_t end, const Term& term_at, const LastTerm& last_term_at) {
  double sum = 0;
  RunWithWidestVectors([&] {
    const Term term = term_at;  // its pointers in registers, whatever it stores
    HalfLanes low{}, high{};
    int64_t i = begin;
    for (; i + kSumLanes <= end; i += kSumLanes) {
      const DoubleLanes terms = term(i);
      low += __builtin_shufflevector(terms, terms, 0, 1, 2, 3);
      high += __builtin_shufflevector(terms, terms, 4, 5, 6, 7);
    }
    for (; i < end; ++i) low[0] += last_term_at(i);
    sum = SumOfLanes(low, high);
  });
  return sum;
}

// The arrays of one solve.
class Solve {
 public:
  Solve(const LinearSystem& system, const std::vector<float>& rhs, const RunContext& run,
        std::vector<float>* x)
      : system_(system),
        run_(run),
        node_count_(static_cast<int64_t>(rhs.size()) / system.unknowns - system.completed_count),
        rhs_(rhs.data()),
        inverse_diagonal_(system.inverse_diagonal()),
        inverse_(inverse_diagonal_.data()),
        x_(x->data()),
        residual_(node_count_ * system.unknowns),
        direction_(rhs.size()),
        product_(residual_.size()) {}

  // Of all nodes.
  double RightSideNorm() const {
    const float *rhs = rhs_, *inverse = inverse_;
    return Sum(node_count_ + system_.completed_count, [=](int64_t begin, int64_t end) {
      return SumOfBlock(
          begin, end,
          [=](int64_t i) {
            const DoubleLanes r = ToDoubles(LoadFloats(rhs + i));
            return r * r * ToDoubles(LoadFloats(inverse + i));
          },
          [=](int64_t i) { return static_cast<double>(rhs[i]) * rhs[i] * inverse[i]; });
    });
  }

  // The residual and the first direction; returns the residual's norm.
  double Start() {
    float *residual = residual_.data(), *direction = direction_.data();
    const float *product = product_.data(), *rhs = rhs_, *inverse = inverse_;
    Complete(rhs, x_);
    for (int pass = 0; pass < system_.passes; ++pass) Apply(pass, x_);
    return Sum(node_count_, [=](int64_t begin, int64_t end) {
      return SumOfBlock(
          begin, end,
          [=](int64_t i) {
            const FloatLanes r = LoadFloats(rhs + i) - LoadFloats(product + i);
            const FloatLanes d = r * LoadFloats(inverse + i);
            StoreFloats(r, residual + i);
            StoreFloats(d, direction + i);
            return ToDoubles(r) * ToDoubles(d);
          },
          [=](int64_t i) {
            residual[i] = rhs[i] - product[i];
            direction[i] = residual[i] * inverse[i];
            return static_cast<double>(residual[i]) * direction[i];
          });
    });
  }

  double Curvature() {
    const float *direction = direction_.data(), *product = product_.data();
    const int last = system_.passes - 1;
    Complete(nullptr, direction_.data());
    for (int pass = 0; pass < last; ++pass) Apply(pass, direction);
    return Sum(node_count_, [&](int64_t begin, int64_t end) {
      system_.apply(last, begin / system_.unknowns, end / system_.unknowns, direction,
                    product_.data());
      return SumOfBlock(
          begin, end,
          [=](int64_t i) {
            return ToDoubles(LoadFloats(direction + i)) * ToDoubles(LoadFloats(product + i));
          },
          [=](int64_t i) { return static_cast<double>(direction[i]) * product[i]; });
    });
  }

  // What is left after a step along the direction; returns the new residual's norm.
  double Reduce(float step) {
    float* residual = residual_.data();
    const float *product = product_.data(), *inverse = inverse_;
    return Sum(node_count_, [=](int64_t begin, int64_t end) {
      return SumOfBlock(
          begin, end,
          [=](int64_t i) {
            const FloatLanes r = LoadFloats(residual + i) - step * LoadFloats(product + i);
            StoreFloats(r, residual + i);
            return ToDoubles(r) * ToDoubles(r) * ToDoubles(LoadFloats(inverse + i));
          },
          [=](int64_t i) {
            residual[i] -= step * product[i];
            return static_cast<double>(residual[i]) * residual[i] * inverse[i];
          });
    });
  }

  // Moves x along the direction and turns that, which is read once for both.
  void MoveAndTurn(float step, float carry) {
    const float *residual = residual_.data(), *inverse = inverse_;
    float *direction = direction_.data(), *x = x_;
    ForUnknowns(node_count_, [=](int64_t, int64_t begin, int64_t end) {
      const auto body = [=](int64_t i) {
        const FloatLanes r = LoadFloats(residual + i) * LoadFloats(inverse + i),
                         d = LoadFloats(direction + i);
        StoreFloats(LoadFloats(x + i) + step * d, x + i);
        StoreFloats(r + carry * d, direction + i);
      };
      RunWithWidestVectors([=] {
        const auto move = body;  // its pointers in registers, whatever it stores
        int64_t i = begin;
        for (; i + kSumLanes <= end; i += kSumLanes) move(i);
        for (; i < end; ++i) {
          x[i] += step * direction[i];
          direction[i] = residual[i] * inverse[i] + carry * direction[i];
        }
      });
    });
  }

  // What follows from the numbers that were solved for.
  void CompleteSolution() { Complete(rhs_, x_); }

 private:
  // body(block, first node, end of the nodes).
  template <class Body>
  void ForBlocks(int64_t node_count, const Body& body) const {
    oneapi::tbb::parallel_for(int64_t{0}, NodeSumBlocks(node_count), [&](int64_t block) {
      if (run_.ShouldStop()) return;
      body(block, block * kNodesPerSum, std::min(node_count, (block + 1) * kNodesPerSum));
    });
  }
  // The same for the unknowns of the nodes.
  template <class Body>
  void ForUnknowns(int64_t node_count, const Body& body) const {
    const int64_t unknowns = system_.unknowns;
    ForBlocks(node_count, [&](int64_t block, int64_t begin, int64_t end) {
      body(block, begin * unknowns, end * unknowns);
    });
  }
  // Of block_sum(first unknown, end of the unknowns), combined in order.
  template <class BlockSum>
  double Sum(int64_t node_count, const BlockSum& block_sum) const {
    std::vector<double> block_sums(NodeSumBlocks(node_count));
    ForUnknowns(node_count, [&](int64_t block, int64_t begin, int64_t end) {
      block_sums[block] = block_sum(begin, end);
    });
    double sum = 0;
    for (const double s : block_sums) sum += s;
    return sum;
  }
  void Apply(int pass, const float* x) {
    ForBlocks(node_count_, [&](int64_t, int64_t begin, int64_t end) {
      system_.apply(pass, begin, end, x, product_.data());
    });
  }
  void Complete(const float* right_side, float* x) const {
    if (system_.completed_count == 0) return;
    ForBlocks(system_.completed_count, [&](int64_t, int64_t begin, int64_t end) {
      system_.complete(begin, end, right_side, x);
    });
  }

  const LinearSystem& system_;
  const RunContext& run_;
  const int64_t node_count_;
  const float* rhs_;
  const std::vector<float> inverse_diagonal_;
  const float* inverse_;
  float* x_;
  std::vector<float> residual_;
  std::vector<float> direction_;  // with room for what follows from it
  std::vector<float> product_;
};

absl::StatusOr<int> SolveOnCpu(const LinearSystem& system, const std::vector<float>& rhs,
                               const ConjugateGradientLimits& limits, const RunContext& run,
                               std::vector<float>* x) {
  if (x->empty()) x->resize(rhs.size(), 0.0F);
  Solve solve(system, rhs, run, x);
  const double goal = limits.tolerance * limits.tolerance * solve.RightSideNorm();
  double norm = solve.Start();
  int iteration = 0;
  for (; iteration < limits.max_iterations && norm > goal; ++iteration) {
    if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
    const double curvature = solve.Curvature();
    if (!(curvature > 0)) break;  // the direction has vanished: nothing left to improve
    const auto step = static_cast<float>(norm / curvature);
    const double next_norm = solve.Reduce(step);
    solve.MoveAndTurn(step, static_cast<float>(next_norm / norm));
    norm = next_norm;
  }
  solve.CompleteSolution();
  if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
  return iteration;
}

}  // namespace

absl::StatusOr<int> SolveConjugateGradient(const LinearSystem& system,
                                           const std::vector<float>& rhs,
                                           const ConjugateGradientLimits& limits,
                                           const RunContext& run, std::vector<float>* x) {
  if (system.device == nullptr) return SolveOnCpu(system, rhs, limits, run, x);
  x->clear();  // the same start wherever it ends up
  GradientTask task;
  task.matrix = system.matrix;
  task.links = system.links;
  task.node_count = ArrayViewOf(rhs).size / system.unknowns;
  task.right_side = ArrayViewOf(rhs);
  task.x = x;
  task.limits = {limits.max_iterations, limits.tolerance};
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
