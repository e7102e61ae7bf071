// Laws of placing anew what has changed since a placement: what has not stays where it is.
#include "optimize/unsettled_vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "optimize/place_vertices.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::GridVertex;
using testing_support::Shake;

constexpr GridSize kLongGrid{9, 3, 3};

std::vector<int32_t> UnsettledOf(CellComplex complex, const CellComplex& settled) {
  const Hull hull = GridHull(kLongGrid, 1.0);
  const HullFeatures features(hull);
  return UnsettledVertices(PreparePlacement(complex, features), settled).list();
}

CellComplex PlacedSince(const CellComplex& complex, const CellComplex* settled) {
  const Hull hull = GridHull(kLongGrid, 1.0);
  RunContext run;
  const auto placed =
      PlaceVertices(complex, HullFeatures(hull), run, PlacementEffort::kValid, nullptr, settled);
  EXPECT_TRUE(placed.ok()) << placed.status();
  return *placed;
}

// A shaken grid one vertex of which, far from the end x = 9, is pushed aside.
struct PushedGrid {
  CellComplex before = GridComplex(kLongGrid);
  CellComplex after;
  int32_t vertex = GridVertex(kLongGrid, 1, 1, 1);

  PushedGrid() {
    Shake(before, 0.15);
    after = before;
    after.vertices[vertex].x += 0.2;
  }
};

TEST(UnsettledVertices, AreThoseOfChangedCellsAndOfTheNextOnes) {
  const PushedGrid pushed;
  std::vector<int32_t> expected;
  for (int z = 0; z <= 3; ++z) {
    for (int y = 0; y <= 3; ++y) {
      for (int x = 0; x <= 3; ++x) expected.push_back(GridVertex(kLongGrid, x, y, z));
    }
  }
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(UnsettledOf(pushed.after, pushed.before), expected);
}

TEST(UnsettledVertices, DoNotDependOnIndicesOrOnTheOrderOfCornersAndCells) {
  const PushedGrid pushed;
  CellComplex other = pushed.after;
  std::reverse(other.vertices.begin(), other.vertices.end());
  const auto last = static_cast<int32_t>(other.vertices.size()) - 1;
  for (CellCorners& corners : other.cells) {
    for (int32_t& v : corners) v = last - v;
    std::rotate(corners.begin(), corners.begin() + 1, corners.begin() + 4);
    std::rotate(corners.begin() + 4, corners.begin() + 5, corners.end());
  }
  std::reverse(other.cells.begin(), other.cells.end());
  EXPECT_TRUE(UnsettledOf(pushed.after, other).empty());
  EXPECT_FALSE(UnsettledOf(pushed.after, pushed.before).empty());
}

TEST(PlaceVertices, LeavesWhatIsSettledAsItIsAsLongAsNoCellIsVeryPoor) {
  const PushedGrid pushed;
  EXPECT_EQ(PlacedSince(pushed.before, &pushed.before).vertices, pushed.before.vertices);
  EXPECT_NE(PlacedSince(pushed.before, nullptr).vertices, pushed.before.vertices);
}

TEST(PlaceVertices, PlacesWhatHasChangedAndDrawsNothingElseToTheHull) {
  const PushedGrid pushed;
  const CellComplex placed = PlacedSince(pushed.after, &pushed.before);
  for (int z = 0; z <= 3; ++z) {
    for (int y = 0; y <= 3; ++y) {
      const auto at_end = static_cast<size_t>(GridVertex(kLongGrid, 9, y, z));
      EXPECT_EQ(placed.vertices[at_end], pushed.before.vertices[at_end]);
      const auto at_start = static_cast<size_t>(GridVertex(kLongGrid, 0, y, z));
      EXPECT_NEAR(placed.vertices[at_start].x, 0, 1e-9);
    }
  }
  EXPECT_GT(std::abs(pushed.before.vertices[0].x), 1e-3) << "it was off the hull before";
}

}  // namespace
}  // namespace amhex
