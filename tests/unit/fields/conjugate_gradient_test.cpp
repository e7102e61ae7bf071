#include "fields/conjugate_gradient.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "fields/field_loops.h"

namespace amhex::fields {
namespace {

constexpr int kUnknowns = 10003;  // fills neither the last lanes nor the last block of a sum

// A chain of springs, each end tied down.
LinearSystem Chain() {
  LinearSystem system;
  system.apply = [](int /*pass*/, int64_t begin, int64_t end, const float* x, float* product) {
    for (int64_t i = begin; i < end; ++i) {
      product[i] = 2.1F * x[i];
      if (i > 0) product[i] -= x[i - 1];
      if (i + 1 < kUnknowns) product[i] -= x[i + 1];
    }
  };
  system.inverse_diagonal = [] { return std::vector<float>(kUnknowns, 1 / 2.1F); };
  return system;
}

std::vector<float> SolveChain(int threads) {
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                          threads);
  const RunContext run;
  std::vector<float> rhs(kUnknowns), x(kUnknowns, 0.0F);
  for (int i = 0; i < kUnknowns; ++i) rhs[i] = static_cast<float>(i % 17);
  EXPECT_TRUE(SolveConjugateGradient(Chain(), rhs, {1000, 1e-5}, run, &x).ok());
  return x;
}

TEST(ConjugateGradient, SolvesUpToTheTolerance) {
  const std::vector<float> x = SolveChain(1);
  std::vector<float> product(kUnknowns);
  Chain().apply(0, 0, kUnknowns, x.data(), product.data());
  for (int i = 0; i < kUnknowns; ++i) EXPECT_NEAR(product[i], i % 17, 0.02);
}

TEST(ConjugateGradient, GivesTheSameBitsOnOneAndOnFourThreads) {
  EXPECT_EQ(SolveChain(1), SolveChain(4));
}

TEST(ConjugateGradient, LeavesAnExactSolutionAlone) {
  const RunContext run;
  std::vector<float> x(kUnknowns, 0.0F);
  const auto iterations =
      SolveConjugateGradient(Chain(), std::vector<float>(kUnknowns, 0.0F), {10, 1e-5}, run, &x);
  ASSERT_TRUE(iterations.ok());
  EXPECT_EQ(*iterations, 0);
  EXPECT_EQ(x, std::vector<float>(kUnknowns, 0.0F));
}

TEST(ConjugateGradient, StartsAtZeroWhereNothingIsGiven) {
  const RunContext run;
  std::vector<float> x;
  const std::vector<float> rhs(kUnknowns, 1.0F);
  ASSERT_TRUE(SolveConjugateGradient(Chain(), rhs, {3, 1e-5}, run, &x).ok());
  std::vector<float> from_zeros(kUnknowns, 0.0F);
  ASSERT_TRUE(SolveConjugateGradient(Chain(), rhs, {3, 1e-5}, run, &from_zeros).ok());
  EXPECT_EQ(x, from_zeros);
}

TEST(ConjugateGradient, ReportsCancellation) {
  RunContext run;
  run.RequestStop();
  std::vector<float> x(kUnknowns, 0.0F);
  const auto iterations =
      SolveConjugateGradient(Chain(), std::vector<float>(kUnknowns, 1.0F), {10, 1e-5}, run, &x);
  EXPECT_EQ(iterations.status().code(), absl::StatusCode::kCancelled);
}

TEST(DeterministicSum, AddsEveryElementOnce) {
  const RunContext run;
  const double sum = DeterministicSum(run, 100001, [](int64_t begin, int64_t end) {
    double partial = 0;
    for (int64_t i = begin; i < end; ++i) partial += static_cast<double>(i);
    return partial;
  });
  EXPECT_EQ(sum, 100000.0 * 100001.0 / 2);
}

}  // namespace
}  // namespace amhex::fields
