#include "closure/hull_patch.h"

#include <gtest/gtest.h>

#include <vector>

#include "support/grid_complex.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridVertex;

// Two cubes side by side; the second one's bottom, looking in.
class RunsThroughCellsTest : public ::testing::Test {
 protected:
  int32_t At(int x, int y, int z) const { return GridVertex({2, 1, 1}, x, y, z); }
  const WorkingMesh mesh_{GridComplex({2, 1, 1})};
  const CellFace bottom_{4, {At(1, 0, 0), At(2, 0, 0), At(2, 1, 0), At(1, 1, 0)}};
};

TEST_F(RunsThroughCellsTest, APatchThatHasNothingOutsideDoesNot) {
  EXPECT_FALSE(RunsThroughCells(mesh_, {bottom_}, {1}));
  EXPECT_FALSE(RunsThroughCells(mesh_, {bottom_}, {}));
}

TEST_F(RunsThroughCellsTest, APatchFromTheOtherSideOfACellThatStaysDoes) {
  EXPECT_TRUE(RunsThroughCells(mesh_, {Reversed(bottom_)}, {}));
  EXPECT_TRUE(RunsThroughCells(mesh_, {bottom_, Reversed(bottom_)}, {0}));
}

TEST_F(RunsThroughCellsTest, APatchThroughACellThatIsReplacedDoesNot) {
  EXPECT_FALSE(RunsThroughCells(mesh_, {Reversed(bottom_)}, {1}));
}

TEST_F(RunsThroughCellsTest, ATriangleAcrossACellDoesWhicheverWayItLooks) {
  const CellFace across{3, {At(0, 0, 0), At(1, 1, 0), At(1, 0, 1), -1}};
  EXPECT_TRUE(RunsThroughCells(mesh_, {across}, {}));
  EXPECT_TRUE(RunsThroughCells(mesh_, {Reversed(across)}, {}));
  EXPECT_FALSE(RunsThroughCells(mesh_, {across}, {0}));
}

}  // namespace
}  // namespace amhex
