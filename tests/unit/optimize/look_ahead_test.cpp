// Steps that are looked at side by side come to what they come to one after the other.
#include "optimize/look_ahead.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <atomic>
#include <cstdint>

namespace amhex {
namespace {

using oneapi::tbb::global_control;

constexpr size_t kSteps = 500;
constexpr int kThreads = 4;

// Step i adds to number i what numbers i - 1 and i / 2 are: one in `every` of them is wanted.
struct Sums {
  explicit Sums(size_t every_nth) : every(every_nth), number(kSteps, 1), changed(kSteps, 0) {}

  struct Found {
    uint32_t sum;
    int64_t looked_at;
  };
  Found Look(size_t i) const { return {number[i] + number[i - (i > 0)] + number[i / 2], clock}; }
  Taken Take(size_t i, std::optional<Found> found) {
    const bool holds = found.has_value() && changed[i - (i > 0)] <= found->looked_at &&
                       changed[i / 2] <= found->looked_at;
    found_ahead += found.has_value() ? 1 : 0;
    if (i % every == 0) number[i] = holds ? found->sum : Look(i).sum, changed[i] = ++clock;
    return holds ? Taken::kHeld : Taken::kAnew;
  }
  void Run(const RunContext& run) {
    TakeLookingAhead<Found>(
        kSteps, run, [&](size_t i) { return Look(i); },
        [&](size_t i, std::optional<Found> found) { return Take(i, found); });
  }

  size_t every;
  std::vector<uint32_t> number;
  std::vector<int64_t> changed;
  int64_t clock = 0;
  size_t found_ahead = 0;
};

TEST(LookAhead, ComesToTheSameOnAnyNumberOfThreads) {
  for (const size_t every : {1, 2, 50}) {
    Sums single(every), several(every);
    {
      const global_control one(global_control::max_allowed_parallelism, 1);
      single.Run(RunContext());
    }
    const global_control more(global_control::max_allowed_parallelism, kThreads);
    several.Run(RunContext());
    EXPECT_EQ(several.number, single.number) << every;
    EXPECT_EQ(single.found_ahead, 0U);
    EXPECT_GT(several.found_ahead, kSteps / 2) << "or the test shows nothing";
  }
}

TEST(LookAhead, EndsWithTheStepThatIsEnough) {
  const global_control more(global_control::max_allowed_parallelism, kThreads);
  constexpr size_t kLast = 100;
  std::vector<size_t> taken;
  TakeLookingAhead<size_t>(
      kSteps, RunContext(), [](size_t i) { return i; },
      [&](size_t i, std::optional<size_t>) {
        taken.push_back(i);
        return i == kLast ? Taken::kEnough : Taken::kHeld;
      });
  ASSERT_EQ(taken.size(), kLast + 1);
  for (size_t i = 0; i < taken.size(); ++i) EXPECT_EQ(taken[i], i);
}

TEST(LookAhead, TakesNothingMoreWhenTheRunIsToStop) {
  const global_control more(global_control::max_allowed_parallelism, kThreads);
  RunContext run;
  std::atomic<size_t> looked = 0;
  size_t taken = 0;
  TakeLookingAhead<int>(
      kSteps, run, [&](size_t) { return ++looked, 0; },
      [&](size_t, std::optional<int>) {
        ++taken;
        run.RequestStop();
        return Taken::kHeld;
      });
  EXPECT_EQ(taken, 1U);
  EXPECT_LT(looked, kSteps);
}

}  // namespace
}  // namespace amhex
