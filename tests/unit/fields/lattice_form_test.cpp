#include "fields/lattice_form.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "fields/hull_edges.h"
#include "fixtures/solids.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

TEST(LatticeForm, ClosesAroundEverySquareWithoutASingularity) {
  const SolvedFields fields(fixtures::MakeSphere(4, 0.5));
  ASSERT_TRUE(fields.ok);
  double sum = 0;
  int64_t squares = 0, singular = 0;
  const GridLevel& level = fields.grid.fine();
  for (int64_t i = 0; i < level.count(); ++i) {
    for (int d = 0; d < 3; ++d) {
      if (!IsRegularSquare(level, fields.codes, i, d)) {
        ++singular;
        continue;
      }
      sum += SquaredNorm(CurlAround(level, fields.codes, fields.form.increments, i, d));
      ++squares;
    }
  }
  ASSERT_GT(squares, 1000);
  EXPECT_GT(singular, 0);  // no frame field of a ball is without them
  // One grid step is about half a cell; a hundredth of that is far below any rounding of phases.
  EXPECT_LT(std::sqrt(sum / static_cast<double>(squares)), 0.005);
}

// Cells gained once around a square of `side` grid squares from `node` on; nothing where one of
// them is missing or singular. The curl of every square is carried to the first node.
std::optional<Vec3f> CirculationAround(const SolvedFields& fields, int64_t node, int d, int side) {
  const GridLevel& level = fields.grid.fine();
  const ForwardCodes& codes = fields.codes;
  const int e = (d + 1) % 3;
  Vec3f sum;
  AxisRotation to_row;
  for (int64_t row = node, y = 0; y < side; ++y) {
    AxisRotation to_square = to_row;
    for (int64_t at = row, x = 0; x < side; ++x) {
      if (!IsRegularSquare(level, codes, at, d)) return std::nullopt;
      sum += to_square.Apply(CurlAround(level, codes, fields.form.increments, at, d));
      to_square = Compose(to_square, kAxisRotations[codes[at][d]]);
      at = level.neighbours[at][d];
    }
    to_row = Compose(to_row, kAxisRotations[codes[row][e]]);
    row = level.neighbours[row][e];
  }
  return sum;
}

TEST(LatticeForm, GainsNoCellAroundSquaresOfManyNodes) {
  const SolvedFields fields(fixtures::MakeSphere(6, 0.5));
  ASSERT_TRUE(fields.ok);
  constexpr int kSide = 8;
  double sum = 0, most = 0;
  int64_t squares = 0;
  for (int64_t i = 0; i < fields.grid.count(); ++i) {
    for (int d = 0; d < 3; ++d) {
      const std::optional<Vec3f> gained = CirculationAround(fields, i, d, kSide);
      if (!gained.has_value()) continue;
      sum += SquaredNorm(*gained);
      most = std::max(most, static_cast<double>(Norm(*gained)));
      ++squares;
    }
  }
  ASSERT_GT(squares, 1000);
  // Half a cell would round to a dislocation, and the whole solid is three times as wide.
  EXPECT_LT(most, 0.02);
  EXPECT_LT(std::sqrt(sum / static_cast<double>(squares)), 0.005);
}

// Mean square of what the increments along the hull differ from the hull's own rise.
double MissOfTheHull(const SolvedFields& fields, double hull_edge_weight) {
  LatticeSettings settings;
  settings.hull_edge_weight = hull_edge_weight;
  RunContext run;
  const auto form = SolveLatticeForm(fields.grid, fields.frames, fields.sizes, fields.codes,
                                     settings, ProgressSlice(run, 0, 1));
  if (!form.ok()) return -1;
  Increments rises(fields.grid.count());
  const auto follows =
      FollowHull({fields.grid, form->frames, form->sizes, fields.codes}, run, &rises);
  double sum = 0;
  int64_t count = 0;
  for (int64_t i = 0; i < fields.grid.count(); ++i) {
    for (int bit = 0; bit < 9; ++bit) {
      const int d = bit / 3, a = bit % 3;
      if (!Follows(follows, i, d, a)) continue;
      const double miss = form->increments[i][d][a] - rises[i][d][a];
      sum += miss * miss;
      ++count;
    }
  }
  return count == 0 ? -1 : sum / static_cast<double>(count);
}

TEST(LatticeForm, DriftsLessAgainstTheHullTheMoreThatWeighs) {
  const SolvedFields fields(fixtures::MakeSphere(6, 0.5));
  ASSERT_TRUE(fields.ok);
  const double never = MissOfTheHull(fields, 1), lightly = MissOfTheHull(fields, 30),
               firmly = MissOfTheHull(fields, 300);
  ASSERT_GT(firmly, 0);
  EXPECT_LT(firmly, lightly);
  EXPECT_LT(lightly, never);
}

TEST(LatticeForm, CountsHalfACellPerStepInABox) {
  const SolvedFields fields(fixtures::MakeBox({3, 4, 5}, 1));
  ASSERT_TRUE(fields.ok);
  for (int64_t i = 0; i < fields.grid.count(); ++i) {
    for (int d = 0; d < 3; ++d) {
      if (fields.grid.fine().neighbours[i][d] < 0) continue;
      EXPECT_NEAR(Norm(fields.form.increments[i][d]), fields.grid.spacing, 1e-3);
    }
  }
}

TEST(LatticeForm, KeepsItsLayersParallelToARoundHull) {
  const SolvedFields fields(fixtures::MakeTorus(8, 2.5, 0.3));
  ASSERT_TRUE(fields.ok);
  const GridLevel& level = fields.grid.fine();
  Increments increments(level.count());
  const auto follows =
      FollowHull({fields.grid, fields.frames, fields.sizes, fields.codes}, fields.run, &increments);
  int64_t followed = 0;
  for (int64_t i = 0; i < level.count(); ++i) {
    for (int bit = 0; bit < 9; ++bit) {
      const int d = bit / 3, a = bit % 3;
      if (!Follows(follows, i, d, a)) continue;
      ++followed;
      // Depths differ by no more than the way between two points of a nearly flat hull.
      EXPECT_LE(std::abs(increments[i][d][a]), 1.5 * fields.grid.spacing / fields.sizes[i][a]);
      const HullConstraint& hull = level.ConstraintsOf(i).front();
      const AxisFrame frame = ToFrame(fields.frames[i]);
      EXPECT_GT(std::abs(Dot(frame.axis[a], hull.normal)), kAlignedCosine);
    }
  }
  EXPECT_GT(followed, 1000);
}

TEST(LatticeForm, HoldsTheWantedDensity) {
  SolvedFields fields(fixtures::MakeTorus(4, 1.6, 0.4));
  ASSERT_TRUE(fields.ok);
  LatticeSettings settings;
  settings.density = 0.7;
  const auto form = SolveLatticeForm(fields.grid, fields.frames, fields.sizes, fields.codes,
                                     settings, ProgressSlice(fields.run, 0, 1));
  ASSERT_TRUE(form.ok());
  double cells = 0;
  for (const std::array<Vec3d, 3>& step : form->steps) {
    const double volume = Determinant(step[0], step[1], step[2]);
    EXPECT_GT(volume, 0);
    cells += 1 / volume;
  }
  EXPECT_NEAR(cells / static_cast<double>(fields.grid.count()), 0.7, 1e-6);
}

}  // namespace
}  // namespace amhex::fields
