// Laws of a fit of lacks: it finds what a search finds, and rows above what is wanted count for
// nothing until they would lack.
#include "optimize/hinge_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace amhex {
namespace {

constexpr double kSmallDamping = 1e-9;

double Remainder(const HingeRow& row, const std::vector<Vec3d>& moves) {
  double lack = row.lack;
  for (const HingeRow::Slope& slope : row.slopes) lack -= Dot(slope.fall, moves[slope.point]);
  return lack;
}

double Cost(const std::vector<HingeRow>& rows, double damping, const std::vector<Vec3d>& moves) {
  double cost = 0;
  for (const HingeRow& row : rows) {
    const double lack = std::max(0.0, Remainder(row, moves));
    cost += lack * lack;
  }
  for (const Vec3d& move : moves) cost += damping * SquaredNorm(move);
  return cost;
}

TEST(HingeFit, OfNothingMovesNothing) {
  EXPECT_EQ(HingeFit({}, 2).Solve(1), std::vector<Vec3d>(2));
}

TEST(HingeFit, MovesNothingWhereNothingLacks) {
  HingeFit fit({{-0.1, {{0, {1, 0, 0}}}}}, 1);
  EXPECT_EQ(fit.Solve(1), std::vector<Vec3d>(1));
}

TEST(HingeFit, MakesGoodWhatTwoPointsCanOnlyMakeGoodTogether) {
  const std::vector<HingeRow> rows = {{0.2, {{0, {1, 0, 0}}, {1, {-1, 0, 0}}}},
                                      {0.1, {{0, {0, 1, 0}}, {1, {1, 1, 0}}}}};
  const std::vector<Vec3d> moves = HingeFit(rows, 2).Solve(kSmallDamping);
  for (const HingeRow& row : rows) EXPECT_NEAR(Remainder(row, moves), 0, 1e-6);
}

// Elimination goes by several rows and columns at a time.
TEST(HingeFit, MakesGoodAnyNumberOfRowsInARing) {
  for (const int count : {3, 4, 5, 7, 8, 9, 15, 16, 17, 41}) {
    std::vector<HingeRow> rows;
    for (int32_t i = 0; i < count; ++i) {
      const int32_t next = (i + 1) % count;
      rows.push_back({0.1 + 0.01 * i, {{i, {1, 0, 0}}, {next, {0.3, 0.2, 0}}}});
    }
    const std::vector<Vec3d> moves = HingeFit(rows, count).Solve(kSmallDamping);
    for (const HingeRow& row : rows) EXPECT_LE(Remainder(row, moves), 1e-6) << count;
  }
}

TEST(HingeFit, SeesRowsThatWouldComeToLack) {
  // Moving the point by 0.3 makes the first good; the second admits 0.1 of it along x.
  const std::vector<HingeRow> rows = {{0.3, {{0, {1, 0.5, 0}}}}, {-0.1, {{0, {-1, 0, 0}}}}};
  const std::vector<Vec3d> moves = HingeFit(rows, 1).Solve(kSmallDamping);
  for (const HingeRow& row : rows) EXPECT_LE(Remainder(row, moves), 1e-6);
}

void ExpectLeastOfAllAround(const std::vector<HingeRow>& rows, double damping, double length) {
  const std::vector<Vec3d> best = HingeFit(rows, 2).Solve(damping);
  for (size_t point = 0; point < best.size(); ++point) {
    for (int a = 0; a < 3; ++a) {
      for (const double step : {-length, length}) {
        std::vector<Vec3d> moves = best;
        moves[point][a] += step;
        EXPECT_GT(Cost(rows, damping, moves), Cost(rows, damping, best));
      }
    }
  }
}

// Both where rows are few and where they are more than coordinates.
TEST(HingeFit, IsTheLeastOfAllAround) {
  constexpr double kDamping = 0.1, kStep = 1e-3;
  std::vector<HingeRow> rows = {{0.3, {{0, {1, 0.5, 0}}, {1, {0, 1, 0}}}},
                                {0.2, {{0, {-1, 0, 0.3}}}},
                                {-0.05, {{1, {0, -1, 0.2}}}}};
  ExpectLeastOfAllAround(rows, kDamping, kStep);
  for (int i = 0; i < 9; ++i) {
    rows.push_back({0.04 * i - 0.02, {{1, {0.2 * i, 1 - 0.3 * i, 0.5}}, {0, {-0.3, 0.1 * i, 1}}}});
  }
  ExpectLeastOfAllAround(rows, kDamping, kStep);
}

}  // namespace
}  // namespace amhex
