#include "base/counter_rng.h"

#include <gtest/gtest.h>

#include <set>

namespace amhex {
namespace {

TEST(CounterRng, DependsOnSeedStreamAndIndexOnly) {
  EXPECT_EQ(RandomBits(1, RandomStream::kGridJitter, 5),
            RandomBits(1, RandomStream::kGridJitter, 5));
  const std::set<uint64_t> values = {
      RandomBits(1, RandomStream::kGridJitter, 5), RandomBits(2, RandomStream::kGridJitter, 5),
      RandomBits(1, RandomStream::kKnnStart, 5), RandomBits(1, RandomStream::kGridJitter, 6)};
  EXPECT_EQ(values.size(), 4u);
}

TEST(CounterRng, UnitNumbersAreUniformInTheUnitInterval) {
  constexpr int kCount = 20000;
  double sum = 0, sum_of_squares = 0;
  for (uint64_t i = 0; i < kCount; ++i) {
    const double u = RandomUnit(7, RandomStream::kKnnStart, i);
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    sum += u;
    sum_of_squares += u * u;
  }
  EXPECT_NEAR(sum / kCount, 0.5, 0.01);
  EXPECT_NEAR(sum_of_squares / kCount, 1.0 / 3, 0.01);
}

}  // namespace
}  // namespace amhex
