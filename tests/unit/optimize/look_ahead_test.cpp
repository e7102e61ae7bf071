// Steps that are looked at side by side come to what they come to one after the other.
#include "optimize/look_ahead.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <new>
#include <thread>

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
  uint32_t SumAt(size_t i) const { return number[i] + number[i - (i > 0)] + number[i / 2]; }
  bool Take(size_t i, const std::optional<Found>& found) {
    found_ahead += found.has_value() ? 1 : 0;
    if (i % every == 0) number[i] = found.has_value() ? found->sum : SumAt(i), changed[i] = ++clock;
    return true;
  }
  // Guesses that a step changes what those up to `reach` behind it find.
  void Run(size_t reach) {
    TakeLookingAhead<Found>(
        kSteps, RunContext(), [&](size_t i, size_t j) { return j - i <= reach; },
        [&](size_t i) {
          return [found = Found{SumAt(i), clock}] { return found; };
        },
        [&](size_t i, const Found& found) {
          return changed[i - (i > 0)] <= found.looked_at && changed[i / 2] <= found.looked_at;
        },
        [&](size_t i, std::optional<Found> found) { return Take(i, found); });
  }

  size_t every;
  std::vector<uint32_t> number;
  std::vector<int64_t> changed;
  int64_t clock = 0;
  size_t found_ahead = 0;
};

TEST(LookAhead, ComesToTheSameOnAnyNumberOfThreadsAndWhateverIsGuessed) {
  for (const size_t every : {1, 2, 50}) {
    Sums single(every);
    {
      const global_control one(global_control::max_allowed_parallelism, 1);
      single.Run(1);
    }
    EXPECT_EQ(single.found_ahead, 0U);
    const global_control more(global_control::max_allowed_parallelism, kThreads);
    for (const size_t reach : {0, 1, 20}) {
      Sums several(every);
      several.Run(reach);
      EXPECT_EQ(several.number, single.number) << every << " " << reach;
      EXPECT_EQ(several.found_ahead, kSteps);
    }
  }
}

const auto kNoneIsNear = [](size_t, size_t) { return false; };

TEST(LookAhead, LooksAtStepsSideBySide) {
  const global_control more(global_control::max_allowed_parallelism, kThreads);
  std::atomic<int> looking = 0, most = 0;
  const auto look = [&](size_t) {
    return [&] {
      int seen = ++looking;
      for (int known = most; seen > known && !most.compare_exchange_weak(known, seen);) {
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return --looking;
    };
  };
  TakeLookingAhead<int>(
      kSteps, RunContext(), kNoneIsNear, look, [](size_t, int) { return true; },
      [](size_t, std::optional<int>) { return true; });
  if (std::thread::hardware_concurrency() > 1) EXPECT_GT(most, 1);
  EXPECT_LE(most, kThreads);
}

TEST(LookAhead, EndsWithTheStepThatIsEnough) {
  const global_control more(global_control::max_allowed_parallelism, kThreads);
  constexpr size_t kLast = 100;
  std::vector<size_t> taken;
  TakeLookingAhead<size_t>(
      kSteps, RunContext(), kNoneIsNear, [](size_t i) { return [i] { return i; }; },
      [](size_t, size_t) { return true; },
      [&](size_t i, std::optional<size_t> found) {
        EXPECT_EQ(found, i);
        taken.push_back(i);
        return i != kLast;
      });
  ASSERT_EQ(taken.size(), kLast + 1);
  for (size_t i = 0; i < taken.size(); ++i) EXPECT_EQ(taken[i], i);
}

TEST(LookAhead, PassesOnWhatIsThrownWhereAStepIsLookedAt) {
  const global_control more(global_control::max_allowed_parallelism, kThreads);
  const auto run = [] {
    TakeLookingAhead<size_t>(
        kSteps, RunContext(), kNoneIsNear,
        [](size_t i) { return [i] { return i < kSteps / 2 ? i : throw std::bad_alloc(); }; },
        [](size_t, size_t) { return true; }, [](size_t, std::optional<size_t>) { return true; });
  };
  EXPECT_THROW(run(), std::bad_alloc);
}

TEST(LookAhead, TakesNothingMoreWhenTheRunIsToStop) {
  const global_control more(global_control::max_allowed_parallelism, kThreads);
  RunContext run;
  std::atomic<size_t> looked = 0;
  size_t taken = 0;
  TakeLookingAhead<int>(
      kSteps, run, kNoneIsNear, [&](size_t) { return [&] { return ++looked, 0; }; },
      [](size_t, int) { return true; },
      [&](size_t, std::optional<int>) {
        ++taken;
        run.RequestStop();
        return true;
      });
  EXPECT_EQ(taken, 1U);
  EXPECT_LT(looked, kSteps);
}

}  // namespace
}  // namespace amhex
