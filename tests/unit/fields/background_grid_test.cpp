#include "fields/background_grid.h"

#include <gtest/gtest.h>

#include "fields/find_neighbours.h"
#include "fixtures/solids.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

absl::StatusOr<BackgroundGrid> GridOf(const Hull& hull) {
  RunContext run;
  return BuildBackgroundGrid(hull, 1.0 / kNodesPerEdge, ProgressSlice(run, 0, 1));
}

TEST(BackgroundGrid, MortonCodesNameCellsBothWays) {
  for (const std::array<int32_t, 3>& cell :
       {std::array<int32_t, 3>{0, 0, 0}, {1, 2, 3}, {1048575, 7, 524288}}) {
    EXPECT_EQ(CellOfKey(KeyOfCell(cell)), cell);
  }
}

TEST(BackgroundGrid, NodesFillTheVolumeAndLieInside) {
  const Hull hull = HullOf(fixtures::MakeSphere(4, 0.5));
  const auto grid = GridOf(hull);
  ASSERT_TRUE(grid.ok());
  const double cell = grid->spacing * grid->spacing * grid->spacing;
  EXPECT_NEAR(static_cast<double>(grid->count()) * cell / hull.volume, 1, 0.03);
  for (int64_t i = 0; i < grid->count(); ++i) {
    EXPECT_TRUE(hull.queries->IsInside(grid->Position(i)));
  }
}

TEST(BackgroundGrid, ABoxOfWholeCellsIsFilledExactly) {
  const auto grid = GridOf(HullOf(fixtures::MakeBox({3, 4, 5}, 1)));
  ASSERT_TRUE(grid.ok());
  EXPECT_EQ(grid->count(), 3 * 4 * 5 * 8);
}

TEST(BackgroundGrid, NeighboursAreMutualAndLieAtTheirOffset) {
  const auto grid = GridOf(HullOf(fixtures::MakeTorus(4, 1.5, 0.5)));
  ASSERT_TRUE(grid.ok());
  for (const GridLevel& level : grid->levels) {
    int64_t links = 0;
    for (int64_t i = 0; i < level.count(); ++i) {
      for (int k = 0; k < kNeighbourCount; ++k) {
        const int32_t j = level.neighbours[i][k];
        if (j < 0) continue;
        ++links;
        EXPECT_EQ(level.neighbours[j][Opposite(k)], i);
        const auto from = CellOfKey(level.key[i]), to = CellOfKey(level.key[j]);
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_EQ(to[axis] - from[axis], NeighbourOffset(k, axis));
        }
      }
    }
    EXPECT_TRUE(links > 0 || level.count() == 1);
  }
}

TEST(BackgroundGrid, EveryNeighbourThatExistsIsFound) {
  const auto grid = GridOf(HullOf(fixtures::MakeSphere(2.2, 0.5)));
  ASSERT_TRUE(grid.ok());
  const GridLevel& level = grid->fine();
  for (int64_t i = 0; i < level.count(); ++i) {
    for (int k = 0; k < kNeighbourCount; ++k) {
      auto cell = CellOfKey(level.key[i]);
      bool is_negative = false;
      for (int axis = 0; axis < 3; ++axis) {
        cell[axis] += NeighbourOffset(k, axis);
        is_negative = is_negative || cell[axis] < 0;
      }
      if (is_negative) continue;
      const bool exists = std::binary_search(level.key.begin(), level.key.end(), KeyOfCell(cell));
      EXPECT_EQ(level.neighbours[i][k] >= 0, exists);
    }
  }
}

// As a device finds them.
TEST(BackgroundGrid, NeighboursFollowFromTheCellsAlone) {
  const auto grid = GridOf(HullOf(fixtures::MakeTorus(4, 1.5, 0.5)));
  ASSERT_TRUE(grid.ok());
  for (const GridLevel& level : grid->levels) {
    const ArrayView<const uint64_t> keys{level.key.data(), level.count()};
    std::vector<int32_t> all(kNeighbourCount * level.count()), along_axes(6 * level.count());
    const FindNeighboursBody find{keys, {all.data(), kNeighbourCount * level.count()}};
    const FindAxisNeighboursBody find_along_axes{keys, {along_axes.data(), 6 * level.count()}};
    for (int64_t i = 0; i < level.count(); ++i) {
      find(i), find_along_axes(i);
      for (int k = 0; k < kNeighbourCount; ++k) {
        EXPECT_EQ(all[kNeighbourCount * i + k], level.neighbours[i][k]);
      }
      for (int d = 0; d < 3; ++d) {
        EXPECT_EQ(along_axes[6 * i + d], level.neighbours[i][d]);
        EXPECT_EQ(along_axes[6 * i + 3 + d], level.neighbours[i][Opposite(d)]);
      }
    }
  }
}

TEST(BackgroundGrid, ColoursCoverAllNodesAndSeparateNeighbours) {
  const auto grid = GridOf(HullOf(fixtures::MakeSphere(3, 0.5)));
  ASSERT_TRUE(grid.ok());
  for (const GridLevel& level : grid->levels) {
    std::vector<int> colour(level.count(), -1);
    for (int c = 0; c < 8; ++c) {
      for (const int32_t node : level.colours[c]) colour[node] = c;
    }
    for (int64_t i = 0; i < level.count(); ++i) {
      EXPECT_GE(colour[i], 0);
      for (const int32_t j : level.neighbours[i]) {
        if (j >= 0) {
          EXPECT_NE(colour[i], colour[j]);
        }
      }
    }
  }
}

TEST(BackgroundGrid, ABoxConstrainsFacesOnceEdgesTwiceAndCornersThrice) {
  const auto grid = GridOf(HullOf(fixtures::MakeBox({3, 4, 5}, 1)));
  ASSERT_TRUE(grid.ok());
  std::array<int64_t, 4> nodes_with{};
  for (int64_t i = 0; i < grid->count(); ++i) {
    ++nodes_with[grid->fine().ConstraintsOf(i).size()];
  }
  // 6 x 8 x 10 nodes, of which 4 x 6 x 8 touch no face.
  EXPECT_EQ(nodes_with[0], 4 * 6 * 8);
  EXPECT_EQ(nodes_with[1], 2 * (4 * 6 + 6 * 8 + 4 * 8));
  EXPECT_EQ(nodes_with[2], 4 * (4 + 6 + 8));
  EXPECT_EQ(nodes_with[3], 8);
}

TEST(BackgroundGrid, RefusesAHullTooThinForANode) {
  // A straight bar is never too thin: nodes stand at the centres of cells that cover its box.
  EXPECT_TRUE(GridOf(HullOf(fixtures::MakeBox({0.2, 0.2, 8}, 0.2))).ok());
  const auto ring = GridOf(HullOf(fixtures::MakeTorus(3.1, 0.01, 0.05)));
  EXPECT_EQ(ring.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(BackgroundGrid, RefusesAnAbsurdlyLongHull) {
  const auto grid = GridOf(HullOf(fixtures::MakeBox({1e7, 1, 1}, 1e6)));
  EXPECT_EQ(grid.status().code(), absl::StatusCode::kResourceExhausted);
}

TEST(BackgroundGrid, StopsWhenAsked) {
  RunContext run;
  run.RequestStop();
  const auto grid = BuildBackgroundGrid(HullOf(fixtures::MakeSphere(3, 0.5)), 1.0 / kNodesPerEdge,
                                        ProgressSlice(run, 0, 1));
  EXPECT_EQ(grid.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex::fields
