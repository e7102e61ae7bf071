#include "fields/conjugate_gradient.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "fields/field_loops.h"

namespace amhex::fields {
namespace {

constexpr int kChainLength = 10003;  // fills neither the last lanes nor the last block of a sum

// A chain of springs, each end tied down.
LinearSystem Chain() {
  LinearSystem system;
  system.apply = [](int /*pass*/, int64_t begin, int64_t end, const float* x, float* product) {
    for (int64_t i = begin; i < end; ++i) {
      product[i] = 2.1F * x[i];
      if (i > 0) product[i] -= x[i - 1];
      if (i + 1 < kChainLength) product[i] -= x[i + 1];
    }
  };
  system.inverse_diagonal = [] { return std::vector<float>(kChainLength, 1 / 2.1F); };
  return system;
}

std::vector<float> SolveChain(int threads) {
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                          threads);
  const RunContext run;
  std::vector<float> rhs(kChainLength), x(kChainLength, 0.0F);
  for (int i = 0; i < kChainLength; ++i) rhs[i] = static_cast<float>(i % 17);
  EXPECT_TRUE(SolveConjugateGradient(Chain(), rhs, {1000, 1e-5}, run, &x).ok());
  return x;
}

TEST(ConjugateGradient, SolvesUpToTheTolerance) {
  const std::vector<float> x = SolveChain(1);
  std::vector<float> product(kChainLength);
  Chain().apply(0, 0, kChainLength, x.data(), product.data());
  for (int i = 0; i < kChainLength; ++i) EXPECT_NEAR(product[i], i % 17, 0.02);
}

TEST(ConjugateGradient, GivesTheSameBitsOnOneAndOnFourThreads) {
  EXPECT_EQ(SolveChain(1), SolveChain(4));
}

// The same chain with its springs' even ends before the odd ones, which follow from them.
constexpr int kEven = (kChainLength + 1) / 2;
int EndOf(int number) { return number < kEven ? 2 * number : 2 * (number - kEven) + 1; }
int NumberOf(int end) { return end % 2 == 0 ? end / 2 : kEven + end / 2; }
float SumBeside(int number, const float* x) {
  const int end = EndOf(number);
  return (end > 0 ? x[NumberOf(end - 1)] : 0) + (end + 1 < kChainLength ? x[NumberOf(end + 1)] : 0);
}
LinearSystem HalvedChain() {
  LinearSystem system = Chain();
  system.apply = [](int /*pass*/, int64_t begin, int64_t end, const float* x, float* product) {
    for (auto i = static_cast<int>(begin); i < end; ++i) {
      product[i] = 2.1F * x[i] - SumBeside(i, x);
    }
  };
  system.completed_count = kChainLength - kEven;
  system.complete = [](int64_t begin, int64_t end, const float* right_side, float* x) {
    for (auto i = static_cast<int>(kEven + begin); i < kEven + end; ++i) {
      x[i] = ((right_side != nullptr ? right_side[i] : 0) + SumBeside(i, x)) / 2.1F;
    }
  };
  return system;
}

TEST(ConjugateGradient, SolvesForHalfOfWhatIsCoupledWithTheOtherHalfOnlyInHalfTheIterations) {
  const RunContext run;
  std::vector<float> rhs(kChainLength), of_halves(kChainLength);
  for (int i = 0; i < kChainLength; ++i) {
    rhs[i] = static_cast<float>(i % 17);
    of_halves[NumberOf(i)] = rhs[i];
  }
  std::vector<float> x, halved;
  const auto whole = SolveConjugateGradient(Chain(), rhs, {1000, 1e-5}, run, &x);
  const auto half = SolveConjugateGradient(HalvedChain(), of_halves, {1000, 1e-5}, run, &halved);
  ASSERT_TRUE(whole.ok() && half.ok());
  EXPECT_NEAR(*half, *whole / 2.0, 2);
  for (int i = 0; i < kChainLength; ++i) EXPECT_NEAR(halved[NumberOf(i)], x[i], 0.01);
}

TEST(ConjugateGradient, WhatFollowsIsThereWhereNothingIsLeftToSolve) {
  const RunContext run;
  std::vector<float> of_halves(kChainLength, 0.0F), x;
  const auto none = SolveConjugateGradient(HalvedChain(), of_halves, {0, 1e-5}, run, &x);
  of_halves[kEven] = 2.1F;
  x.clear();
  const auto of_one = SolveConjugateGradient(HalvedChain(), of_halves, {0, 1e-5}, run, &x);
  ASSERT_TRUE(none.ok() && of_one.ok());
  EXPECT_EQ(x[kEven], 1.0F);
}

TEST(ConjugateGradient, LeavesAnExactSolutionAlone) {
  const RunContext run;
  std::vector<float> x(kChainLength, 0.0F);
  const auto iterations =
      SolveConjugateGradient(Chain(), std::vector<float>(kChainLength, 0.0F), {10, 1e-5}, run, &x);
  ASSERT_TRUE(iterations.ok());
  EXPECT_EQ(*iterations, 0);
  EXPECT_EQ(x, std::vector<float>(kChainLength, 0.0F));
}

TEST(ConjugateGradient, StartsAtZeroWhereNothingIsGiven) {
  const RunContext run;
  std::vector<float> x;
  const std::vector<float> rhs(kChainLength, 1.0F);
  ASSERT_TRUE(SolveConjugateGradient(Chain(), rhs, {3, 1e-5}, run, &x).ok());
  std::vector<float> from_zeros(kChainLength, 0.0F);
  ASSERT_TRUE(SolveConjugateGradient(Chain(), rhs, {3, 1e-5}, run, &from_zeros).ok());
  EXPECT_EQ(x, from_zeros);
}

TEST(ConjugateGradient, ReportsCancellation) {
  RunContext run;
  run.RequestStop();
  std::vector<float> x(kChainLength, 0.0F);
  const auto iterations =
      SolveConjugateGradient(Chain(), std::vector<float>(kChainLength, 1.0F), {10, 1e-5}, run, &x);
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
