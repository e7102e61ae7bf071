// Visiting vertices side by side comes to what visiting them one after the other does.
#include "optimize/visit_by_colour.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <random>
#include <vector>

#include "support/grid_complex.h"

namespace amhex {
namespace {

using oneapi::tbb::global_control;
using testing_support::GridComplex;

constexpr int kThreads = 4;

struct Grid {
  Grid() : complex(GridComplex({12, 11, 10})), neighbourhoods(FindNeighbourhoods(complex)) {}

  std::vector<int32_t> All() const {
    std::vector<int32_t> all(complex.vertices.size());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

  // Every vertex gets one more than the largest of those that share a cell with it.
  void Visit(int32_t v, std::vector<int>& numbers) const {
    int largest = 0;
    for (const int32_t c : neighbourhoods.cells[v]) {
      for (const int32_t w : complex.cells[c]) largest = std::max(largest, numbers[w]);
    }
    numbers[v] = largest + 1;
  }

  CellComplex complex;
  VertexNeighbourhoods neighbourhoods;
};

// One vertex in `every`, none where it is 0, those of a ball in any case.
std::vector<uint8_t> Wanted(const Grid& grid, uint64_t every, double ball) {
  std::mt19937_64 random(1);
  std::vector<uint8_t> wanted;
  for (const Vec3d& p : grid.complex.vertices) {
    const bool is_drawn = random() % std::max<uint64_t>(every, 1) == 0 && every > 0;
    wanted.push_back(is_drawn || Norm(p - Vec3d{6, 6, 5}) < ball ? 1 : 0);
  }
  return wanted;
}

TEST(VisitByColour, ComesToWhatOneVertexAfterTheOtherDoes) {
  const Grid grid;
  const global_control threads(global_control::max_allowed_parallelism, kThreads);
  VisitScratch scratch;  // the same for all, as for one sweep after the other
  struct Case {
    uint64_t every;
    double ball;
  };
  // All, many, some single ones, single ones and one large cluster, none.
  for (const Case& wish : {Case{1, 0}, {3, 0}, {60, 0}, {60, 3}, {0, 0}}) {
    const std::vector<uint8_t> wanted = Wanted(grid, wish.every, wish.ball);
    std::vector<int> numbers(wanted.size(), 0), in_turn = numbers;
    for (const std::vector<int32_t>& colour : grid.neighbourhoods.colours) {
      for (const int32_t v : colour) {
        if (wanted[v] != 0) grid.Visit(v, in_turn);
      }
    }
    const absl::Status status = VisitByColour(
        grid.neighbourhoods, grid.All(), RunContext(), [&](int32_t v) { return wanted[v] != 0; },
        [&](int32_t v) { grid.Visit(v, numbers); }, scratch);
    EXPECT_TRUE(status.ok());
    EXPECT_EQ(numbers, in_turn) << wish.every << " " << wish.ball;
  }
}

TEST(VisitByColour, AsksForNoOthersThanThoseGiven) {
  const Grid grid;
  std::vector<int32_t> among = grid.All();
  std::erase_if(among, [](int32_t v) { return v % 3 != 0; });
  VisitScratch scratch;
  std::vector<std::atomic<int>> asked(grid.complex.vertices.size()), visited(asked.size());
  ASSERT_TRUE(VisitByColour(
                  grid.neighbourhoods, among, RunContext(),
                  [&](int32_t v) {
                    ++asked[v];
                    return v % 2 == 0;
                  },
                  [&](int32_t v) { ++visited[v]; }, scratch)
                  .ok());
  for (size_t v = 0; v < asked.size(); ++v) {
    EXPECT_EQ(asked[v], v % 3 == 0 ? 1 : 0) << v;
    EXPECT_EQ(visited[v], v % 6 == 0 ? 1 : 0) << v;
  }
}

TEST(VisitByColour, EndsWithTheReasonWhenTheRunIsToStop) {
  const Grid grid;
  for (const uint64_t every : {1, 60}) {
    const std::vector<uint8_t> wanted = Wanted(grid, every, 0);
    RunContext run;
    run.RequestStop();
    std::atomic<int> visits = 0;
    VisitScratch scratch;
    const absl::Status status = VisitByColour(
        grid.neighbourhoods, grid.All(), run, [&](int32_t v) { return wanted[v] != 0; },
        [&](int32_t) { ++visits; }, scratch);
    EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(visits, 0);
  }
}

}  // namespace
}  // namespace amhex
