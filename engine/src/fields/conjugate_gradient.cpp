#include "fields/conjugate_gradient.h"

#include <cstdint>

#include "fields/field_loops.h"

namespace amhex::fields {
namespace {

// Sum of term(i) over one block in four interleaved partial sums: fixed order, short dependency.
template <class Term>
double BlockSum(int64_t begin, int64_t end, const Term& term) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  int64_t i = begin;
  for (; i + 4 <= end; i += 4) {
    s0 += term(i);
    s1 += term(i + 1);
    s2 += term(i + 2);
    s3 += term(i + 3);
  }
  for (; i < end; ++i) s0 += term(i);
  return (s0 + s1) + (s2 + s3);
}

template <class Term>
double Sum(const RunContext& run, int64_t count, const Term& term) {
  return DeterministicSum(run, count,
                          [&](int64_t begin, int64_t end) { return BlockSum(begin, end, term); });
}

}  // namespace

absl::StatusOr<int> SolveConjugateGradient(const LinearSystem& system,
                                           const std::vector<float>& rhs,
                                           const ConjugateGradientLimits& limits,
                                           const RunContext& run, std::vector<float>* x) {
  const auto count = static_cast<int64_t>(rhs.size());
  const std::vector<float>& diagonal = system.diagonal;
  std::vector<float> residual(count), direction(count), product(count);
  system.apply(*x, product);
  const double rhs_norm = Sum(
      run, count, [&](int64_t i) { return static_cast<double>(rhs[i]) * rhs[i] / diagonal[i]; });
  double norm = Sum(run, count, [&](int64_t i) {
    residual[i] = rhs[i] - product[i];
    direction[i] = residual[i] / diagonal[i];
    return static_cast<double>(residual[i]) * direction[i];
  });
  const double goal = limits.tolerance * limits.tolerance * rhs_norm;
  int iteration = 0;
  for (; iteration < limits.max_iterations && norm > goal; ++iteration) {
    if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
    system.apply(direction, product);
    const double curvature =
        Sum(run, count, [&](int64_t i) { return static_cast<double>(direction[i]) * product[i]; });
    if (!(curvature > 0)) break;  // the direction has vanished: nothing left to improve
    const auto step = static_cast<float>(norm / curvature);
    const double next_norm = Sum(run, count, [&](int64_t i) {
      (*x)[i] += step * direction[i];
      residual[i] -= step * product[i];
      return static_cast<double>(residual[i]) * residual[i] / diagonal[i];
    });
    const auto carry = static_cast<float>(next_norm / norm);
    norm = next_norm;
    ForEach(run, count,
            [&](int64_t i) { direction[i] = residual[i] / diagonal[i] + carry * direction[i]; });
  }
  if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
  return iteration;
}

}  // namespace amhex::fields
